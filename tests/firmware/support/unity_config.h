/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Unity on bare metal: the test's output goes to the host through semihosting.
 */
#ifndef CANOPY_TESTS_UNITY_CONFIG_H
#define CANOPY_TESTS_UNITY_CONFIG_H

#include "semihosting.h"

#define UNITY_OUTPUT_CHAR(character) semihosting_put_char((char)(character))
#define UNITY_OUTPUT_FLUSH() semihosting_flush()
#define UNITY_EXCLUDE_FLOAT
#define UNITY_EXCLUDE_MATH_H

#endif
