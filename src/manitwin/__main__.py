"""``python -m manitwin``: the same as the command ``manitwin``."""

from manitwin.cli.entry import main

if __name__ == "__main__":
    main()
