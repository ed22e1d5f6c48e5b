"""The atlas: maps of when learning becomes innate, with laws and claims stated before."""
