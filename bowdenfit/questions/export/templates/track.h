/*
 * Friction followed while the route changes: a Kalman filter on the friction exponent, a random walk that begins at the
 * posterior of any one mounting. It learns from samples in which the rope slides and waits in all others: after each turn of
 * the input force until the output force has moved along, by ten standard deviations of its noise; and what it learned counts
 * when the input force has gone on by as much, because one that turns meanwhile shows less friction than there is. While it
 * waits the estimate stays where it is and its interval widens with time, as the route may go on changing. Filter noise beforehand,
 * both forces alike, so that force_sd is small against the strokes; where the filter is slower than the samples, the interval
 * is too narrow by as much.
 */
typedef struct {
    double exponent, variance; /* friction exponent at the reference speed, mean of both strokes, and its variance */
    double drift, force_sd;    /* how far the exponent wanders in a second (standard deviation); noise of a sample in newtons */
    double share[2];           /* exponent while pulling and while returning over their mean */
    double highest, lowest;    /* input force since the turn */
    double start;              /* output force that a motion since the turn is counted from */
    double counted;            /* input force up to which samples count */
    double next, next_variance; /* exponent and variance with the samples since */
    int heading, sliding;      /* +1 pulling, -1 returning, 0 not known yet; whether the rope slid at the last sample */
} bowden_tracker;

/* Begin at the posterior for a place; drift and force_sd must be above 0. Returns 0, or BOWDEN_INVALID. */
static inline int bowden_track_start(bowden_tracker *tracker, double place, double drift, double force_sd)
{
    int flags = 0, i;
    double end[2];
    const int levels[2] = {BOWDEN_MOUNTING_Q05, BOWDEN_MOUNTING_Q95};
    const double pulling = bowden_at(bowden_exponent[BOWDEN_Q50][0], place, &flags);
    const double returning = bowden_at(bowden_exponent[BOWDEN_Q50][1], place, &flags);

    if (isnan(pulling) || !(drift > 0.0) || !(force_sd > 0.0)) {
        return BOWDEN_INVALID;
    }
    for (i = 0; i < 2; i++) {
        end[i] = 0.5 * (bowden_at(bowden_exponent[levels[i]][0], place, 0) + bowden_at(bowden_exponent[levels[i]][1], place, 0));
    }
    tracker->exponent = 0.5 * (pulling + returning);
    tracker->variance = (end[1] - end[0]) * (end[1] - end[0]) / (2.0 * 1.645) / (2.0 * 1.645);
    tracker->drift = drift;
    tracker->force_sd = force_sd;
    tracker->share[0] = pulling / tracker->exponent;
    tracker->share[1] = returning / tracker->exponent;
    tracker->highest = tracker->lowest = tracker->start = tracker->counted = NAN;
    tracker->next = tracker->exponent;
    tracker->next_variance = tracker->variance;
    tracker->heading = tracker->sliding = 0;
    return 0;
}

/* Whether the rope slides, by how both forces have moved since the turn. */
static inline int bowden_track_slides(bowden_tracker *tracker, double input_force, double output_force)
{
    const double clear = 10.0 * tracker->force_sd;
    int heading = tracker->heading;

    if (isnan(tracker->start)) {
        tracker->highest = tracker->lowest = input_force;
        tracker->start = output_force;
    }
    tracker->highest = fmax(tracker->highest, input_force);
    tracker->lowest = fmin(tracker->lowest, input_force);
    if (tracker->heading >= 0 && input_force < tracker->highest - clear) {
        heading = -1;
    } else if (tracker->heading <= 0 && input_force > tracker->lowest + clear) {
        heading = 1;
    }
    if (heading != tracker->heading) {
        tracker->heading = heading;
        tracker->highest = tracker->lowest = tracker->counted = input_force;
        tracker->start = output_force;
        tracker->next = tracker->exponent;
        tracker->next_variance = tracker->variance;
    }
    if (heading == 0) {
        return 0;
    }
    tracker->start = heading > 0 ? fmin(tracker->start, output_force) : fmax(tracker->start, output_force);
#if BOWDEN_PRESLIDING
    if (heading * (bowden_to_scale(BOWDEN_Q50, output_force) - bowden_to_scale(BOWDEN_Q50, tracker->start))
        < 5.0 / bowden_presliding[BOWDEN_Q50][0]) {
        return 0; /* friction is not built up yet */
    }
#endif
    return heading * (output_force - tracker->start) > clear;
}

/*
 * Take a sample, seconds after the one before; returns the friction exponent. Samples with a force that is NAN or not above 0
 * teach nothing, and as little do those in which nothing slides.
 */
static inline double bowden_track(bowden_tracker *tracker, double speed, double input_force, double output_force, double seconds)
{
    double slope_in, slope_out, gain, noise, ratio, carries;

    tracker->sliding = 0;
    if (seconds > 0.0) {
        tracker->variance += tracker->drift * tracker->drift * seconds;
        tracker->next_variance += tracker->drift * tracker->drift * seconds;
    }
    if (!(input_force > 0.0) || !(output_force > 0.0) || isinf(input_force) || isinf(output_force)
        || (BOWDEN_RATE_DEPENDENT && isnan(speed)) || !bowden_track_slides(tracker, input_force, output_force)) {
        return tracker->exponent;
    }
#if BOWDEN_LOAD_DEPENDENT
    ratio = bowden_scale(BOWDEN_Q50, input_force) - bowden_scale(BOWDEN_Q50, output_force);
    slope_in = pow((input_force + bowden_load[BOWDEN_Q50][1]) / BOWDEN_REFERENCE_FORCE, bowden_load[BOWDEN_Q50][0] - 1.0);
    slope_out = pow((output_force + bowden_load[BOWDEN_Q50][1]) / BOWDEN_REFERENCE_FORCE, bowden_load[BOWDEN_Q50][0] - 1.0);
    slope_in /= BOWDEN_REFERENCE_FORCE;
    slope_out /= BOWDEN_REFERENCE_FORCE;
#else
    ratio = log(input_force / output_force);
    slope_in = 1.0 / input_force;
    slope_out = 1.0 / output_force;
#endif
    tracker->sliding = 1;
    carries = tracker->share[tracker->heading < 0] * bowden_rate(BOWDEN_Q50, speed);
    noise = tracker->force_sd * tracker->force_sd * (slope_in * slope_in + slope_out * slope_out);
    gain = tracker->next_variance * carries / (carries * carries * tracker->next_variance + noise);
    tracker->next = fmax(tracker->next + gain * (tracker->heading * ratio - carries * tracker->next), 0.0);
    tracker->next_variance *= 1.0 - gain * carries;
    if (tracker->heading * (input_force - tracker->counted) > 10.0 * tracker->force_sd) {
        tracker->counted = input_force;
        tracker->exponent = tracker->next;
        tracker->variance = tracker->next_variance;
    }
    return tracker->exponent;
}

/* The 90 % interval of the friction exponent. */
static inline void bowden_track_interval(const bowden_tracker *tracker, double *low, double *high)
{
    const double half = 1.645 * sqrt(tracker->variance);

    *low = fmax(tracker->exponent - half, 0.0);
    *high = tracker->exponent + half;
}

