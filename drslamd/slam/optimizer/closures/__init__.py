"""The paper's pose graph (section III-C) without its relaxation, solved exactly on every robot.

Entry: `closure_optimizer.ClosureOptimizer.job`. `gnc` takes the weight of closures that the rest of
the graph contradicts, `pose_graph_solver` minimises, `symmetric` factorises.
"""
