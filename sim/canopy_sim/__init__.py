# SPDX-License-Identifier: MIT
"""Robot simulator: a NAO as a process on CAN and LCM, small (Examples 4 and 5) or whole (the Big BT's).

plant        the robot's physics: the C library in sim/plant, typed
sensors      what its sensors show, message by message
deeds        what a person at a desk can do to it
events       what happens to it, in words
timetable    what is done to it at which time: a mission's file
e2e          AUTOSAR E2E Profile 11: protect what is sent, check what is received
frames       frames of the DBC: packed, protected, checked
messages     the robot's side of the DBC
robot        commands in, freshness, the step of the plant, sensors out
small_mission  Examples 4 and 5 and their robot in this process
mission      the Big BT and its robot in this process, without a bus
process      the event loops on the bus: lock-step and real time
summary      what a run amounts to, as JSON and as text
lcm_side     state, events and health out, commands in, over LCM
cli          the program canopy-sim
"""

__version__ = "0.1.0"
