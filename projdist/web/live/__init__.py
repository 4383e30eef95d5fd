"""The live page: maps that are drawn anew while the hand moves, by a server on this machine or in a notebook."""
