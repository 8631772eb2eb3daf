/* SPDX-License-Identifier: MIT */
/** @file Computes in floating point: CheckFreestanding.cmake must refuse it where that needs helpers. */
double poison_scale(double value);

double poison_scale(double value)
{
    return value * 0.1;
}
