"""Robots from files: URDF and MJCF become robot files, and tuned values go back. Read `importing` first.

MuJoCo's `MjSpec` reads and compiles both formats; all else here is what a World has, and what it has no place for.
"""
