"""Files from outside read with care, and files of ours written whole or not at all."""

from focalgradient.files.names import inner_name, plain_name, printable, refuse_overwriting
from focalgradient.files.reading import (
    LARGEST,
    is_text,
    opened,
    parse_json,
    read_array,
    read_arrays,
    read_bytes,
    read_json,
    read_text,
    read_toml,
)
from focalgradient.files.writing import (
    existing,
    flush,
    move,
    replace_set,
    replacing,
    staged,
    sweep,
    write_whole,
)

__all__ = [
    "LARGEST",
    "existing",
    "flush",
    "inner_name",
    "is_text",
    "move",
    "opened",
    "parse_json",
    "plain_name",
    "printable",
    "read_array",
    "read_arrays",
    "read_bytes",
    "read_json",
    "read_text",
    "read_toml",
    "refuse_overwriting",
    "replace_set",
    "replacing",
    "staged",
    "sweep",
    "write_whole",
]
