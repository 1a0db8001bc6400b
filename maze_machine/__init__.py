"""The application: the loop, robot profiles, campaigns, reports, pages and the command line."""

__version__ = "0.1.0"
