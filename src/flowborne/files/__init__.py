"""Files of any kind: given ones read within limits, own ones written whole or not at all."""
