"""Functions for Python users and for the command line: run, report, replay and export studies."""
