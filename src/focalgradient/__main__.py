"""`python -m focalgradient`: the command line."""

from focalgradient.cli import main

if __name__ == "__main__":
    main(prog_name="focalgradient")
