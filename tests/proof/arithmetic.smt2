; SPDX-License-Identifier: MIT
; Z3: the axioms of wp_arithmetic.c follow from C's definitions; and what the ring's places need. Each answer must be unsat:
; no counterexample.
(define-fun two32 () Int 4294967296)
(define-fun two64 () Int 18446744073709551616)
(declare-const a Int)

(push) ; wraps_32; a conversion to unsigned is modulo (C11 6.3.1.3)
(assert (and (<= (- two32) a) (< a 0) (not (= (mod a two32) (+ a two32)))))
(check-sat)
(pop)

(push) ; over_32
(assert (and (<= two32 a) (< a (* 2 two32)) (not (= (mod a two32) (- a two32)))))
(check-sat)
(pop)

(push) ; wraps_64
(assert (and (<= (- two64) a) (< a 0) (not (= (mod a two64) (+ a two64)))))
(check-sat)
(pop)

(push) ; masked
(declare-const bits (_ BitVec 32))
(declare-const mask (_ BitVec 32))
(assert (not (bvule (bvand bits mask) mask)))
(check-sat)
(pop)

(push) ; two indices less than capacity apart, a power of two, have two places: what waits is never overwritten
(declare-const one (_ BitVec 32))
(declare-const other (_ BitVec 32))
(declare-const capacity (_ BitVec 32))
(define-fun last () (_ BitVec 32) (bvsub capacity #x00000001))
(assert (and (not (= capacity #x00000000)) (= (bvand capacity last) #x00000000)))
(assert (and (not (= one other)) (bvult (bvsub one other) capacity)))
(assert (= (bvand one last) (bvand other last)))
(check-sat)
(pop)
