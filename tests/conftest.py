"""What holds for all tests."""

import signal

# A shell that starts a program in the background lets it ignore Ctrl-C, and so all that it starts; tests press it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
