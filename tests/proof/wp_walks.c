/* SPDX-License-Identifier: MIT */
/** @file For Frama-C's WP: the engine's walks over the children of a node, in any well-formed tree. */
#include "wp_tree.h"

#include "nodes/parallel.h"
#include "nodes/try_catch.h"
