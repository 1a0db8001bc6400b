"""Views for people: the live page, plots, reports."""
