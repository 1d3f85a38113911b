/* Why particles appear and disappear, in the order of the columns of ledger.csv. CAUSE_IN(id, key, label), CAUSE_OUT(id, key, label). */
CAUSE_IN(EMITTED, "emitted", "emitted by blocks")
CAUSE_IN(WINDOW, "entered_window", "that came in with the moving window")
CAUSE_IN(INFLOW, "inflow", "let in at the edge")
CAUSE_OUT(WINDOW, "left_window", "left behind by the moving window")
CAUSE_OUT(OUTFLOW, "outflow", "taken out above the still surface at the edge")
CAUSE_OUT(ESCAPED, "escaped", "that left the domain")
