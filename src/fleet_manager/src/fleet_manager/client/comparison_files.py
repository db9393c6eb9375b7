# SPDX-License-Identifier: BSD-3-Clause
"""The files that `hive compare` writes into the folder of its results, for whoever shows them."""

PAGE = "page.html"  # tables and pictures, for a browser
TABLE = "table.csv"  # the figures of each run
SHOWN = "shown.json"  # `table`, rows of texts with a heading, and `pictures`, files by title
