"""The atlas: the best maps of countries, states, continents, oceans and zones, measured beforehand."""
