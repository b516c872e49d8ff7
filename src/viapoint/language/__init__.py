"""What a program is: source text, tree, grammar, parser, diagnostics and their catalogue, units.

`reading.read_source` gives a `Source`, `parser.parse` its tree and diagnostics, `render` shows them.
Knows no bytecode, no robot and no numerics.
"""
