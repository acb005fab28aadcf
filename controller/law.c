// SPDX-License-Identifier: BSD-3-Clause
// The list of laws.
//
// Units    none.
// Frames   none.
// Arrays   indexed by enum lw_law_name.
// Memory   constants.
// Errors   none.
#include "controller/law.h"

#include "controller/apf.h" // lw_apf_law

const struct lw_law *lw_law_get(enum lw_law_name name)
{
    static const struct lw_law *const laws[] = {[LW_LAW_APF] = &lw_apf_law};
    return laws[name];
}
