"""Maps: roads that somebody else has drawn, read, checked, drawn and written.

A map is a file of a road network, such as OpenDRIVE, and what adeye makes of it. Nothing is
simulated here, and nothing here knows scenarios. Begin with ``opendrive``, the records of a file.
"""
