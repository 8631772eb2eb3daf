/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Whole cycles of an application: drain, decode, tick, commit, trace. For the host and for bare metal.
 *
 * The application is BENCH_APP. Its controller has BENCH_MAILBOXES mailboxes, whose frames leave one by one after the
 * cycle, with an interrupt each; with 0 a bus in memory takes the frames' place. The frames that arrive before each cycle are bench_frames, as cycle.py makes them. What is
 * counted is canopy_loop_step(&bench_loop), so the frames' E2E headers are made outside of it.
 */
#ifndef BENCH_CYCLE_H
#define BENCH_CYCLE_H

#include "canopy/loop.h"

extern const canopy_app_t BENCH_APP;

/** What arrives before each cycle, E2E headers still missing. Made by cycle.py. */
extern const canopy_can_frame_t bench_frames[];
extern const uint32_t bench_frame_count;

extern canopy_loop_t bench_loop;

/** Sets the application up. @return canopy_loop_init()'s canopy_error_t */
int32_t bench_cycle_start(void);

/** The next deadline has come, and the frames have arrived, with the next E2E counter. */
void bench_cycle_prepare(void);

/** With mailboxes: lets a frame out. Then it is time for bench_cycle_interrupt(). @return false: none was left */
bool bench_cycle_let_out(void);

/** The transmit interrupt. */
void bench_cycle_interrupt(void);

/** Since the start: frames that were not accepted or not sent, faults, overruns. Not 0: the figures are worth nothing. */
uint32_t bench_cycle_failures(void);

#endif
