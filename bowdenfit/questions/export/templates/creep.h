/*
 * Presliding: after a turn of the motion the rope creeps while friction builds up (docs/theory.md, presliding).
 */

/* Presliding stiffness, and damping of the bristles over their stiffness in seconds, by level. */
static const double bowden_presliding[BOWDEN_LEVELS][2] = {
$presliding
};

/*
 * State of a rope that creeps: the force at the load side, the friction on the scale on which it is a shift, what it grows to
 * in steady sliding, and how stiffly.
 */
typedef struct {
    double output_force, friction, limit, stiffness;
} bowden_state;

#define BOWDEN_START {NAN, 0.0, 0.0, 0.0} /* before the first sample: the force starts in the middle of the friction band */

static inline double bowden_to_scale(int level, double force)
{
#if BOWDEN_LOAD_DEPENDENT
    return bowden_scale(level, force);
#else
    (void)level;
    return log(force);
#endif
}

static inline double bowden_from_scale(int level, double scaled)
{
#if BOWDEN_LOAD_DEPENDENT
    return bowden_force(level, scaled);
#else
    (void)level;
    return exp(scaled);
#endif
}

/*
 * How far the output moves while the input moves on by a change: d + build_up (1 - exp(-stiffness d)) = change. By Newton's
 * method, of friction that builds up for Lambert's function, from the side on which it cannot overshoot.
 */
static inline double bowden_creep(double change, double build_up, double stiffness)
{
    const double let_go = fmin(-stiffness * build_up, 0.9), reach = stiffness * change;
    const double a = log(fmax(stiffness * build_up, 1e-300)) + stiffness * (build_up - change);
    double log_w = a > 1.0 ? log(a) : a, moved = 0.0;
    int i;

    if (build_up < 0.0) {
        moved = 2.0 * reach / (sqrt((1.0 - let_go) * (1.0 - let_go) + 2.0 * let_go * reach) + 1.0 - let_go);
        for (i = 0; i < 5; i++) {
            const double left = let_go * exp(-moved);
            moved -= (moved - let_go + left - reach) / (1.0 - left);
        }
        return moved / stiffness;
    }
    for (i = 0; i < 5; i++) {
        const double w = exp(log_w);
        log_w -= (w + log_w - a) / (w + 1.0);
    }
    return fmin(fmax(change - build_up + exp(log_w) / stiffness, 0.0), change);
}

/* What friction has yet to follow of a change of its limit in proportion to the motion, 1/u - 1/(exp(u) - 1). */
static inline double bowden_left_behind(double motion)
{
    return motion < 1e-3 ? 0.5 - motion / 12.0 : 1.0 / motion - 1.0 / expm1(motion);
}

/* How fast friction builds up at the end of a motion, over its mean rate, u/(exp(u) - 1). */
static inline double bowden_share_at_end(double motion)
{
    return motion < 1e-3 ? 1.0 - 0.5 * motion : motion / expm1(motion);
}

/*
 * Force at the load side during any motion; call it once per sample, with the time since the sample before (0 if it is not
 * known: the bristles are then not damped). Stable however long that is. The state begins as BOWDEN_START; where the result is
 * NAN it is unchanged.
 */
static inline double bowden_move(
    int level, double place, double speed, double input_force, double seconds, bowden_state *state, int *flags)
{
    double half, middle, x, y, friction, lead, sign, limit, most, build_up, lag, stiffness, mean_stiffness, moved;

    if (!bowden_valid(level, speed, input_force, flags)) {
        return NAN;
    }
    half = 0.5 * bowden_lambda(level, place, speed, 1, flags);
    middle = half;
    half += 0.5 * bowden_lambda(level, place, speed, -1, flags);
    middle = 2.0 * middle - half;
    if (isnan(half)) {
        return NAN;
    }
    x = bowden_to_scale(level, fmax(input_force, 0.0)) - middle;
    if (!(input_force > 0.0)) {
        bowden_raise(flags, BOWDEN_SLACK);
        state->output_force = state->friction = 0.0;
        return 0.0;
    }
    stiffness = bowden_presliding[level][0] / bowden_rate(level, speed);
    if (!(state->output_force > 0.0)) { /* it begins in the middle of its friction band, or was slack and slides */
        friction = isnan(state->output_force) ? 0.0 : half;
        y = x - friction;
        state->limit = half;
        state->stiffness = stiffness;
    } else {
        y = bowden_to_scale(level, state->output_force);
        friction = state->friction;
    }
    lag = seconds > 0.0 ? bowden_presliding[level][1] / seconds : 0.0;
    mean_stiffness = 0.5 * (state->stiffness + stiffness);
    limit = half + bowden_left_behind(mean_stiffness * fabs(x - y - friction)) * (state->limit - half);
    most = fmin(limit, half) + 0.9 / (mean_stiffness * (1.0 + lag));
    friction = fmin(fmax(friction, -most), most);
    lead = fabs(x - y - friction);
    sign = x - y - friction < 0.0 ? -1.0 : 1.0;
    build_up = limit - sign * friction;
    moved = bowden_creep(lead, build_up * (1.0 + lag), mean_stiffness);
    lag *= bowden_share_at_end(mean_stiffness * moved);
    moved = bowden_creep(lead, build_up * (1.0 + lag), mean_stiffness);
    state->friction = sign * (limit - build_up * exp(-mean_stiffness * moved));
    state->limit = half;
    state->stiffness = stiffness;
    state->output_force = bowden_from_scale(level, y + sign * moved);
    if (!(state->output_force > 0.0)) {
        bowden_raise(flags, BOWDEN_SLACK);
        state->output_force = 0.0;
    }
    return state->output_force;
}

