"""What results mean: tests, intervals and trends, what tuning has found, and the sentences that say so.

`comparisons` judges pairs by the tests of `statistics`, `judged` the ends of curves, `misfit` and `identification` what
tuning has found, and `sensitivity` what fitness depends on. What they find becomes words once: `wording` writes
p-values, intervals and ±, `sentences` the verdict, what pairs and curves say, and `simulator_sentences` what tuned
simulators say. `tables` describes each table once, and writes it for papers. The page, commands, the client and reports
print these.
"""
