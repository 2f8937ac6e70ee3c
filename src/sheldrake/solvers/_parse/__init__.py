"""From expressions and formulas to the most special cost or constraint that fits."""
