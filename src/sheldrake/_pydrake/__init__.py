"""The roof: what is here only because pydrake does it so.

The alias (`alias`), Drake's defaults for what is built under it (`defaults`), retired names and ways to call
(`retired`), which names pydrake has (`names`), and modules that collect the names of others (`roll_up`). Nothing below
imports it.
"""
