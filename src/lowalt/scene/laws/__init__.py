"""Laws that effects share: fast fading, wind-blown land, flight in wind, linear Gaussian processes,
clocks.
"""
