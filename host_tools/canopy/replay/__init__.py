# SPDX-License-Identifier: MIT
"""`canopy replay`: a log of a bus, and the program that was the controller, once more and bit for bit."""
