"""`python -m projdist` is the command line."""

from projdist.cli import main

if __name__ == "__main__":
    main()
