# SPDX-License-Identifier: MIT
"""The stand-in for the robot: the plant of the paper's Examples 4 and 5, as a process on CAN and LCM.

plant        the robot's physics: the C library in sim/plant, typed
e2e          AUTOSAR E2E Profile 11: protect what is sent, check what is received
messages     the robot's side of the DBC: frames packed and checked
robot        commands in, freshness, the step of the plant, sensors out
process      the event loops on the bus: lock-step and real time
summary      what a run amounts to, as JSON and as text
lcm_side     state out and commands in, over LCM
cli          the program canopy-sim
"""

__version__ = "0.1.0"
