/* SPDX-License-Identifier: MIT */
/**
 * @file For Frama-C's WP: what C says of conversions to unsigned and of &, which WP leaves open. Z3 proves each axiom
 * by itself (arithmetic.smt2); the lemma, WP.
 */
#include "canopy/clock.h"

/*@ axiomatic arithmetic {
      axiom wraps_32: \forall integer a; -0x100000000 <= a < 0 ==> (uint32_t)a == a + 0x100000000;
      axiom over_32: \forall integer a; 0x100000000 <= a < 0x200000000 ==> (uint32_t)a == a - 0x100000000;
      axiom wraps_64: \forall integer a; -0x10000000000000000 <= a < 0 ==> (uint64_t)a == a + 0x10000000000000000;
      axiom masked: \forall integer a, mask; 0 <= a < 0x100000000 && 0 <= mask < 0x100000000 ==>
                    0 <= (a & mask) <= mask;
    }
    lemma times: \forall integer a, b, c; 0 <= a <= b && 0 <= c ==> 0 <= a * c <= b * c;
*/
