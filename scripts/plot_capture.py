#!/usr/bin/python3
"""isochron.plot_capture of app/python, to be run from a checkout: --help shows its use."""

import sys

import use_package
from isochron.plot_capture import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
