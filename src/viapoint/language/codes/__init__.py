"""The entries of the catalogue, one module per range of codes; read them through `catalogue.py`."""
