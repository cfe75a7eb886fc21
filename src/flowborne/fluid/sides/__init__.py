"""The kinds of sides of a domain: a class each, on the contract in `side`.

Solvers ask a side what it does and never test its kind, so a further kind is one more class and
its table in `scenes.sides`.
"""
