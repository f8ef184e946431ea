"""The paper's figures and claims beside stored studies: `docs/reproduction.md`, from archives.

Read in this order: `paper.py` has the paper's numbers, `studies.py` the values of stored studies, `evidence.py` the
tests and the rules of a verdict, `claims.py` and `pairs.py` the claims, `document.py` the text.
"""
