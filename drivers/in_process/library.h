/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The functions of an application's shared library, as canopy.inprocess in Python calls them; library.py there knows them by
 * name. Those that can go wrong give a canopy_error_t.
 */
#ifndef CANOPY_IN_PROCESS_LIBRARY_H
#define CANOPY_IN_PROCESS_LIBRARY_H

#include <stddef.h>

#include "canopy/in_process.h"

uint32_t canopy_library_version(void);
const char *canopy_library_name(void);
uint64_t canopy_library_period(void);
uint32_t canopy_library_hash(void);
uint32_t canopy_library_nodes(void);
int canopy_library_open(bool with_trace);
uint32_t canopy_library_receives(uint32_t id, bool is_extended);
uint32_t canopy_library_sends(uint32_t id, bool is_extended);
int canopy_library_put(uint32_t message, const uint8_t *data, uint32_t length, uint64_t age);
int canopy_library_hold(uint32_t message, bool is_held);
int canopy_library_read(uint32_t message, uint8_t *data, uint32_t size);
uint64_t canopy_library_run(uint64_t ticks, uint32_t until);
uint32_t canopy_library_root(void);
uint64_t canopy_library_now(void);
int canopy_library_set_now(uint64_t now);
uint32_t canopy_library_faults(void);
uint32_t canopy_library_rejected(void);
const uint8_t *canopy_library_statuses(void);
int canopy_library_status(uint32_t node, bool last);
void canopy_library_halt(void);
void canopy_library_watch(uint8_t *seen);
int canopy_library_run_image(const uint8_t *bytes, size_t size);
const void *canopy_library_entry(uint32_t index, canopy_in_process_entry_t *entry);

/** Made with the application: its entries, and one more that nobody reads. */
extern const canopy_in_process_entry_t canopy_in_process_entries[];
extern const uint32_t canopy_in_process_entry_count;

#endif
