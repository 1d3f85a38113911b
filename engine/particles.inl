/* What a fluid particle carries from step to step, once: the sort permutes it, states save it, the hash covers it.
 * PARTICLE_FIELD(field, scalar type, scalars, state type) */
PARTICLE_FIELD(position, float, 4, STATE_F32)            /* m, window-local; [3] left over from the solves, not read */
PARTICLE_FIELD(velocity, float, 4, STATE_F32)            /* m/s; [3] left over from the solves, not read */
PARTICLE_FIELD(pressure, float, 1, STATE_F32)            /* p dt^2 / rho0 of the density solve, m^2: its warm start */
PARTICLE_FIELD(pressure_divergence, float, 1, STATE_F32) /* the same of the divergence solve */
PARTICLE_FIELD(prediction, float, 1, STATE_F32)          /* rho / rho0 that the last density solve expected now; 0: none; -1 to 0: set free lately, just now if -1 */
PARTICLE_FIELD(id, uint64_t, 1, STATE_U64)               /* never reused */
PARTICLE_FIELD(birth, double, 1, STATE_F64)              /* s */
PARTICLE_FIELD(row_size, uint32_t, 1, STATE_U32)        /* fluid neighbours in the last search, all << 16 | near ones: the sort puts like beside like */
PARTICLE_FIELD(edge, uint8_t, 1, STATE_U8)                /* of a window: ParticleEdge */
