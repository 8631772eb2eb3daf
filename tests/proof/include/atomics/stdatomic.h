/* SPDX-License-Identifier: MIT */
/** @file For Frama-C, which knows no atomics: one thread's view, in which an atomic access is a plain one. */
#ifndef PROOF_STDATOMIC_H
#define PROOF_STDATOMIC_H

#define _Atomic

typedef enum { memory_order_relaxed, memory_order_acquire, memory_order_release, memory_order_seq_cst } memory_order;

#define atomic_init(object, value) ((void)(*(object) = (value)))
#define atomic_load(object) (*(object))
#define atomic_store(object, value) ((void)(*(object) = (value)))
#define atomic_load_explicit(object, order) (*(object))
#define atomic_store_explicit(object, value, order) ((void)(*(object) = (value)))

#endif
