"""Attacks by files and shots that are damaged or made to do harm: `make hostile` runs thousands, the tests a sample."""
