"""The query language of lists: `strategy = informative and fitness > 0.5`.

`parsing` turns a text into a tree, `fields` says what can be asked, and `conditions` makes SQL of both.
"""
