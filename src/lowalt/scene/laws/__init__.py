"""Laws that effects share.

They are fast fading, wind-blown land, flight in wind, linear Gaussian processes and clocks.
"""
