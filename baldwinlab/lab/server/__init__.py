"""The web server of the lab: access, routes and responses."""
