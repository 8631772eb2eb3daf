/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C's WP: the validator, of which it proves that what it accepts is well formed (wp_tree.h); and that its
 * table of shapes, which nodes.def makes, is what wp_tree.h says of the types.
 */
#include "wp_chain.h"

#include "tree_validate.c"

/*@ predicate shape_fits(integer type) =
        canopy_shape_is(type, shapes[type].least, shapes[type].most, shapes[type].words, shapes[type].parameters);
*/

/*@ assigns \nothing;
    ensures canopy_shapes_fit;
*/
static void shapes_of_nodes_def(void)
{
    //@ assert CANOPY_EACH_TYPE(shape_fits, &&);
    //@ assert \forall integer type; CANOPY_EACH_TYPE(type ==, ||) ==> shape_fits(type);
}
