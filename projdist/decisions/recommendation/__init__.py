"""The best existing CRS for a region: candidates, trials, standing and order."""
