"""Commands on folders and parts that are generated from small grammars, with a printed seed.

`make faults` tries 500 folders and 200 parts, and `make test` a fixed sample.
"""
