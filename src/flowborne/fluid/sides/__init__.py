"""The kinds of sides of a domain: one class and one file each, on the contract in `side`.

Solvers ask a side what it does and never test its kind, so a further kind is one more file here and
its table in `scenes.sides`.
"""
