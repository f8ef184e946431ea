"""The paper's figures and claims beside stored studies: `docs/reproduction.md`, from archives.

Read in this order: `page.toml` has the claims and the text, `paper.py` the paper's numbers, `studies.py` the values of
stored studies, `claims.py` what a claim finds in them and the rules of verdicts, `page.py` the page.
"""
