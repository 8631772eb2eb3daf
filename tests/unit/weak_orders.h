/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Included before the runtime's sources: every atomic access becomes a relaxed one. ThreadSanitizer must find that, or it
 * would not find it in the runtime either.
 */
#ifndef CANOPY_TESTS_WEAK_ORDERS_H
#define CANOPY_TESTS_WEAK_ORDERS_H

#include <stdatomic.h>

/* NOLINTBEGIN(readability-identifier-naming): they are the standard's. */
#undef atomic_load
#undef atomic_store
#define atomic_load(object) atomic_load_explicit((object), memory_order_relaxed)
#define atomic_store(object, value) atomic_store_explicit((object), (value), memory_order_relaxed)
#define memory_order_acquire memory_order_relaxed
#define memory_order_release memory_order_relaxed
#define memory_order_seq_cst memory_order_relaxed
/* NOLINTEND(readability-identifier-naming) */

#endif
