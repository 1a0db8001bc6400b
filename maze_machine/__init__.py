"""The application: the loop, robot profiles, campaigns, reports, pages and the command line."""
