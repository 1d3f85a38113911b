/* Why particles appear and disappear, in the order of the columns of ledger.csv. CAUSE_IN(id, key, label), CAUSE_OUT(id, key, label). */
CAUSE_IN(EMITTED, "emitted", "emitted by blocks")
CAUSE_OUT(ESCAPED, "escaped", "that left the domain")
