"""How wrong areas, lengths and bearings of people's own data are in a CRS."""
