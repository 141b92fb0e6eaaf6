"""Simulation of guides: the protocol of simulators, head motion, wind, obstacles, and a runner.

The simulators are plugins: `manager.call("make_simulator", "rods", groom=groom)` returns a
`Simulator`.

* `contact_kernels`: contact of nodes with head and torso, compiled
* `embedding`: guides' own points on nodes, and those that hands hold
* `guide_simulator`: guides, head, torso and drawn points of all simulators
* `hair_cells`: mass and momentum of hair on a grid, compiled
* `hair_grid`: contact between strands as changes of velocity
* `held_guides`: what holds guides in their captured shape: skin, hair around, ties
* `lanes`: records of many strands side by side, for compiled code
* `motion`: motion of the head: keyframes and shakes
* `node_simulator`: time, motion of head and torso, and air of simulators whose guides have nodes
* `obstacle_kernels`: distances to obstacles, and drawn points out of them, compiled
* `obstacles`: head and torso as signed distances on grids
* `posing`: a groom at one frame of a simulation
* `quaternion`: arrays of unit quaternions
* `rigid_motion`: the head's motion within a step, and how the torso follows
* `running`: runs a simulator without a window
* `simulator`: the protocol of all simulators
* `substeps`: what substeps of a frame are given
* `vectors`: vectors and quaternions of numbers, for compiled code
* `wind`: mean wind and gusts
* `wind_shadow`: what hair and head leave of wind
"""

from __future__ import annotations

from hairkit.simulation.motion import HeadMotion, Shake, add_shakes, read_motion, static_motion
from hairkit.simulation.running import Weather, run
from hairkit.simulation.simulator import Grab, Measures, Simulator, Surroundings, check_grabs

__all__ = [
    "Grab",
    "HeadMotion",
    "Measures",
    "Shake",
    "Simulator",
    "Surroundings",
    "Weather",
    "add_shakes",
    "check_grabs",
    "read_motion",
    "run",
    "static_motion",
]
