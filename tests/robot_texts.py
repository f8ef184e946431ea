"""Robots as texts, for the tests that import one."""

MJCF = """<mujoco model="m"><compiler angle="radian"/><option timestep="0.004"/><worldbody>
<geom type="plane" size="1 1 1" friction="0.5 0 0"/>
<body name="base" pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .05" mass="2" friction="0.7 0 0"/>
<body name="a" pos=".1 0 0" euler=".1 .2 .3"><joint name="ja" axis="0 2 0" pos=".01 .02 0" ref=".3" range="-1 1"
 frictionloss=".1" armature=".01" damping=".2"/><geom type="capsule" size=".02" fromto="0 0 0 0 0 -.2" mass=".3"/>
<body name="b" pos="0 0 -.2"><joint name="jb" type="slide" axis="1 0 0" ref=".05"/>
<geom type="ellipsoid" size=".02 .03 .04" mass=".2" friction="1.5 0 0"/>
<body name="c"><joint name="jc" axis="0 0 1"/><geom type="sphere" size=".01" mass=".1"/></body></body></body></body>
</worldbody>
<actuator><position name="pa" joint="ja" kp="50" kv="2" gear="3" forcerange="-4 4"/>
<velocity name="vb" joint="jb" kv="7" ctrlrange="-1 1"/>{}</actuator></mujoco>"""
"""A box on the ground with a hinge, a slide and a passive hinge; `{}` takes more actuators."""
