"""The live page: interactive maps, served on this machine or in a notebook."""
