/*
 * Friction followed while the route changes, by load cells that are not ideal.
 *
 * A Kalman filter estimates the friction exponent, a random walk that begins at the posterior of any one mounting; the ratio
 * of the cells' gains, which strokes to and fro tell apart from friction; and noise that is not white. What samples cannot
 * tell apart from friction, the zeros of the cells and the latency of the output, it considers: their uncertainty is in the
 * interval and stays there (Schmidt, Advances in Control Systems 3 (1966), 293). The covariance is stored as U D U', so that
 * no variance becomes negative in single precision (Bierman, Factorization Methods for Discrete Sequential Estimation (1977),
 * chapter V); define BOWDEN_REAL as float to store it so.
 *
 * It learns from samples in which the rope slides and waits in all others: after each reversal of the input force until the
 * output force has moved along, by ten standard deviations of its noise; and what it learned counts when the input force has
 * gone on by as much, because one that turns meanwhile shows less friction than there is. While it waits the estimate stays
 * where it is and its interval widens with time, as the route may go on changing.
 *
 * It tests itself: sums of innovations (samples minus what was expected of them) must be as large as white noise makes them,
 * and the exponent must not move more from stroke to stroke than drift and sensors allow. Otherwise bowden_track_interval
 * returns BOWDEN_CANNOT_TELL, and the interval is as wide as without averaging over samples, or as strokes disagree.
 *
 * Of a loop the preload counts as fitted: one that changes looks like a change of the exponent.
 */
#ifndef BOWDEN_REAL
#define BOWDEN_REAL double
#endif

#define BOWDEN_CANNOT_TELL 8  /* flag of bowden_track_interval: samples contradict what was said of drift and sensors */
#define BOWDEN_SPANS 2        /* innovations are summed over 8 and over 64 samples */
#define BOWDEN_MEMORY 100     /* sums that the tests remember */
#define BOWDEN_STROKES 16     /* strokes that the tests remember */
#define BOWDEN_MOST 25.0      /* square of 5 standard deviations: more of a single surprise does not count */
#define BOWDEN_RATE_TIME 0.01 /* seconds over which forces are smoothed to tell how fast they change */
#define BOWDEN_GAIN_AGE 300.0 /* seconds after which the cells' gains may have changed again */

/* What is known of the sensors: standard deviations; of an error that is known within a limit, that limit. */
typedef struct {
    double force_sd;   /* noise of a sample of either cell in newtons */
    double noise_time; /* correlation time of that noise in seconds, such as the time constant of a filter; 0 if white */
    double gain_sd;    /* logarithm of the output cell's gain over the input cell's */
    double zero_sd;    /* zero of either cell in newtons */
    double latency_sd; /* how much later or earlier the output is measured than the input in seconds */
} bowden_sensors;

/* The sensors of the fit; NAN stands for what it does not tell and you must. */
static const bowden_sensors bowden_fitted_sensors = {$sensors};

/* State of the filter: noise over its standard deviation; exponent at the reference speed; log ratio of the gains. */
enum { BOWDEN_NOISE, BOWDEN_EXPONENT, BOWDEN_GAIN, BOWDEN_STATES };

/* Errors that it considers, over their standard deviations. */
enum { BOWDEN_ZERO_IN, BOWDEN_ZERO_OUT, BOWDEN_LATENCY, BOWDEN_CONSIDERED };

typedef struct {
    BOWDEN_REAL mean[BOWDEN_STATES];
    BOWDEN_REAL u[BOWDEN_STATES][BOWDEN_STATES], d[BOWDEN_STATES]; /* covariance U D U'; of U what is above its diagonal */
    BOWDEN_REAL shift[BOWDEN_CONSIDERED][BOWDEN_STATES];           /* of the mean, by each considered error */
    BOWDEN_REAL sum[BOWDEN_SPANS];                                 /* of standardized innovations */
    BOWDEN_REAL sum_shift[BOWDEN_SPANS][BOWDEN_CONSIDERED];        /* of that sum, by each considered error */
    BOWDEN_REAL ratio[BOWDEN_SPANS];             /* mean square of these sums, over what white noise makes it */
    BOWDEN_REAL capped[BOWDEN_SPANS];            /* the same of squares up to BOWDEN_MOST */
    int count[BOWDEN_SPANS], sums[BOWDEN_SPANS]; /* innovations in the sum; sums in the mean */
} bowden_estimate;

typedef struct {
    bowden_estimate counted, next;        /* what counts, and the same with the samples since */
    bowden_sensors sensors;
    double considered[BOWDEN_CONSIDERED]; /* standard deviations */
    double drift;                         /* how far the exponent wanders in a second (standard deviation) */
    double share[2];                      /* exponent while pulling and while returning over their mean */
    double twice_preload;                 /* of a loop in newtons */
    double highest, lowest;               /* input force since the reversal */
    double start;                         /* output force that a motion since the reversal is counted from */
    double counted_force;                 /* input force up to which samples count */
    double smooth, smoother, smooth_output, rate; /* input force filtered once and twice; output force; newtons per second */
    double factor, smooth_factor, growth; /* logarithm of bowden_rate, filtered once and twice; its change per second */
    double sample_sd;                     /* noise of a single sample, as an exponent */
    double stroke_mean, stroke_variance, stroke_shift[BOWDEN_CONSIDERED]; /* exponent at the reversal */
    double moved, disagreement;           /* mean square move of the exponent by a stroke; the same over what is expected */
    double last_move, alternates;         /* the last move over what is expected; mean product of successive ones */
    int strokes;                          /* in these means; -1 before the first stroke has ended */
    int heading, sliding;                 /* +1 pulling, -1 returning, 0 not known yet; whether it slid at the last sample */
} bowden_tracker;

/* Variance of one state. */
static inline double bowden_estimate_variance(const bowden_estimate *estimate, int i)
{
    double variance = estimate->d[i];
    int j;

    for (j = i + 1; j < BOWDEN_STATES; j++) {
        variance += (double)estimate->u[i][j] * estimate->u[i][j] * estimate->d[j];
    }
    return variance;
}

/* Let time pass: the exponent wanders, noise decays, and gains may change. */
static inline void bowden_estimate_wait(bowden_estimate *estimate, const bowden_tracker *tracker, double seconds)
{
    const bowden_sensors *sensors = &tracker->sensors;
    const double decay = sensors->noise_time > 0.0 ? exp(-seconds / sensors->noise_time) : 0.0;
    const double fresh = sensors->noise_time > 0.0 ? 1.0 - decay * decay : 0.0;
    const double walk = tracker->drift * tracker->drift * seconds, most = sensors->gain_sd * sensors->gain_sd;
    BOWDEN_REAL *d = estimate->d, (*u)[BOWDEN_STATES] = estimate->u;
    const double u01 = decay * u[0][1], before = d[1];
    int k;

    d[1] += walk;
    d[0] = decay * decay * d[0] + fresh + u01 * u01 * before * walk / d[1];
    d[2] = fmin(d[2] * (1.0 + 2.0 * seconds / BOWDEN_GAIN_AGE), fmax(d[2], most));
    u[0][1] = u01 * before / d[1];
    u[0][2] *= decay;
    estimate->mean[BOWDEN_NOISE] *= decay;
    for (k = 0; k < BOWDEN_CONSIDERED; k++) {
        estimate->shift[k][BOWDEN_NOISE] *= decay;
    }
}

/* Add an innovation to the sums that tell whether they are white; what is considered may move them all alike. */
static inline void bowden_estimate_test(bowden_estimate *estimate, double innovation, const double *shift, const double *sd)
{
    int i, k;

    for (i = 0; i < BOWDEN_SPANS; i++) {
        const int length = i ? 64 : 8;
        double expected = length, square;

        estimate->sum[i] += innovation;
        for (k = 0; k < BOWDEN_CONSIDERED; k++) {
            estimate->sum_shift[i][k] += shift[k] * sd[k];
        }
        if (++estimate->count[i] < length) {
            continue;
        }
        for (k = 0; k < BOWDEN_CONSIDERED; k++) {
            expected += estimate->sum_shift[i][k] * estimate->sum_shift[i][k];
            estimate->sum_shift[i][k] = 0.0;
        }
        estimate->sums[i] += estimate->sums[i] < BOWDEN_MEMORY;
        square = estimate->sum[i] * estimate->sum[i] / expected;
        estimate->ratio[i] += (square - estimate->ratio[i]) / estimate->sums[i];
        estimate->capped[i] += (fmin(square, BOWDEN_MOST) - estimate->capped[i]) / estimate->sums[i];
        estimate->sum[i] = 0.0;
        estimate->count[i] = 0;
    }
}

/* Learn from a reading: row . state and considered . errors, with white noise of a variance (Bierman's update). */
static inline void bowden_estimate_learn(bowden_estimate *estimate, const double *row, const double *considered,
                                         double reading, double noise, const double *sd)
{
    double f[BOWDEN_STATES], gain[BOWDEN_STATES], shift[BOWDEN_CONSIDERED], total = noise;
    int i, j, k;

    for (j = 0; j < BOWDEN_STATES; j++) {
        f[j] = row[j];
        for (i = 0; i < j; i++) {
            f[j] += estimate->u[i][j] * row[i];
        }
    }
    for (j = 0; j < BOWDEN_STATES; j++) {
        const double v = estimate->d[j] * f[j], before = total;

        total += v * f[j];
        estimate->d[j] *= before / total;
        gain[j] = v;
        for (i = 0; i < j; i++) {
            const double u = estimate->u[i][j];

            estimate->u[i][j] = u - f[j] / before * gain[i];
            gain[i] += u * v;
        }
    }
    for (k = 0; k < BOWDEN_CONSIDERED; k++) {
        shift[k] = considered[k];
        for (j = 0; j < BOWDEN_STATES; j++) {
            shift[k] -= row[j] * estimate->shift[k][j];
        }
        for (j = 0; j < BOWDEN_STATES; j++) {
            estimate->shift[k][j] += gain[j] / total * shift[k];
        }
        shift[k] /= sqrt(total);
    }
    for (j = 0; j < BOWDEN_STATES; j++) {
        reading -= row[j] * estimate->mean[j];
    }
    for (j = 0; j < BOWDEN_STATES; j++) {
        estimate->mean[j] += gain[j] / total * reading;
    }
    bowden_estimate_test(estimate, reading / sqrt(total), shift, sd);
}

/* Begin at the posterior for a place, with your sensors; drift and force_sd must be above 0. Returns 0, or BOWDEN_INVALID. */
static inline int bowden_track_start_with(bowden_tracker *tracker, double place, double drift, const bowden_sensors *sensors)
{
    static const bowden_estimate nothing = {{0}, {{0}}, {0}, {{0}}, {0}, {{0}}, {0}, {0}, {0}, {0}};
    int flags = 0, i;
    double end[2];
    const int levels[2] = {BOWDEN_MOUNTING_Q05, BOWDEN_MOUNTING_Q95};
    const double pulling = bowden_at(bowden_exponent[BOWDEN_Q50][0], place, &flags);
    const double returning = bowden_at(bowden_exponent[BOWDEN_Q50][1], place, &flags);
    const double exponent = 0.5 * (pulling + returning);
    bowden_estimate *next = &tracker->next;

    if (isnan(pulling) || !(drift > 0.0) || !(sensors->force_sd > 0.0) || !(sensors->noise_time >= 0.0)
        || !(sensors->gain_sd >= 0.0) || !(sensors->zero_sd >= 0.0) || !(sensors->latency_sd >= 0.0)) {
        return BOWDEN_INVALID;
    }
    for (i = 0; i < 2; i++) {
        end[i] = 0.5 * (bowden_at(bowden_exponent[levels[i]][0], place, 0)
                        + bowden_at(bowden_exponent[levels[i]][1], place, 0));
    }
#if BOWDEN_LOOP
    tracker->twice_preload = bowden_at(bowden_taut_loss[BOWDEN_Q50], place, 0) / exponent;
    if (tracker->twice_preload > 0.0) { /* what a mounting loses while taut, in exponents */
        const double taut[2] = {bowden_at(bowden_taut_loss[levels[0]], place, 0) / tracker->twice_preload,
                                bowden_at(bowden_taut_loss[levels[1]], place, 0) / tracker->twice_preload};
        end[0] = fmin(end[0], taut[0]);
        end[1] = fmax(end[1], taut[1]);
    }
#else
    tracker->twice_preload = 0.0;
#endif
    *next = nothing;
    next->mean[BOWDEN_EXPONENT] = exponent;
    next->d[BOWDEN_NOISE] = sensors->noise_time > 0.0;
    next->d[BOWDEN_EXPONENT] = (end[1] - end[0]) * (end[1] - end[0]) / (2.0 * 1.645) / (2.0 * 1.645);
    next->d[BOWDEN_GAIN] = sensors->gain_sd * sensors->gain_sd;
    tracker->counted = *next;
    tracker->considered[BOWDEN_ZERO_IN] = tracker->considered[BOWDEN_ZERO_OUT] = sensors->zero_sd;
    tracker->considered[BOWDEN_LATENCY] = sensors->latency_sd;
    tracker->sensors = *sensors;
    tracker->drift = drift;
    tracker->share[0] = pulling / exponent;
    tracker->share[1] = returning / exponent;
    tracker->highest = tracker->lowest = tracker->start = tracker->counted_force = tracker->smooth = NAN;
    tracker->rate = tracker->growth = tracker->sample_sd = 0.0;
    tracker->moved = tracker->disagreement = tracker->last_move = tracker->alternates = 0.0;
    tracker->stroke_mean = exponent;
    tracker->stroke_variance = next->d[BOWDEN_EXPONENT];
    tracker->stroke_shift[0] = tracker->stroke_shift[1] = tracker->stroke_shift[2] = 0.0;
    tracker->strokes = -1;
    tracker->heading = tracker->sliding = 0;
    return 0;
}

/* The same with the sensors as the fit has them, but for the noise of a sample. */
static inline int bowden_track_start(bowden_tracker *tracker, double place, double drift, double force_sd)
{
    bowden_sensors sensors = bowden_fitted_sensors;

    sensors.force_sd = force_sd;
    return bowden_track_start_with(tracker, place, drift, &sensors);
}

/* At a reversal: compare how far the exponent has moved with what drift and sensors allow, and drop what does not count. */
static inline void bowden_track_reverse(bowden_tracker *tracker)
{
    const double variance = bowden_estimate_variance(&tracker->counted, BOWDEN_EXPONENT);
    const double moved = tracker->counted.mean[BOWDEN_EXPONENT] - tracker->stroke_mean;
    double expected = tracker->stroke_variance - variance, move;
    int k;

    if (expected > 1e-3 * tracker->stroke_variance) { /* it learned */
        for (k = 0; k < BOWDEN_CONSIDERED; k++) {
            const double by_error = tracker->counted.shift[k][BOWDEN_EXPONENT] - tracker->stroke_shift[k];

            expected += by_error * by_error * tracker->considered[k] * tracker->considered[k];
        }
        move = moved / sqrt(expected);
        if (tracker->strokes >= 0) { /* the first stroke moves away from the fit, which may be of another mounting */
            tracker->strokes += tracker->strokes < BOWDEN_STROKES;
            tracker->disagreement += (fmin(move * move, BOWDEN_MOST) - tracker->disagreement) / tracker->strokes;
            tracker->moved += (moved * moved - tracker->moved) / tracker->strokes;
            tracker->alternates += (fmax(move * tracker->last_move, -BOWDEN_MOST) - tracker->alternates) / tracker->strokes;
            tracker->last_move = move;
        } else {
            tracker->strokes = 0;
        }
    }
    tracker->stroke_mean = tracker->counted.mean[BOWDEN_EXPONENT];
    tracker->stroke_variance = variance;
    for (k = 0; k < BOWDEN_CONSIDERED; k++) {
        tracker->stroke_shift[k] = tracker->counted.shift[k][BOWDEN_EXPONENT];
    }
    tracker->next = tracker->counted;
}

/* Whether the rope slides, by how both forces have moved since the reversal. */
static inline int bowden_track_slides(bowden_tracker *tracker, double input_force, double output_force)
{
    const double clear = 10.0 * tracker->sensors.force_sd;
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
        tracker->highest = tracker->lowest = tracker->counted_force = input_force;
        tracker->start = output_force;
        bowden_track_reverse(tracker);
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
 * What friction takes while the rope slides, on the scale on which it is a shift (of a loop in newtons), in a form that is
 * linear in the exponent. slope: by exponent, input force and output force, at filtered forces of the samples before. At the
 * forces of the sample itself its noise would pass for a signal, and the gain would be learned from noise.
 */
static inline double bowden_track_reading(
    const bowden_tracker *tracker, double speed, double input_force, double output_force, double *slope)
{
    const double carries = tracker->share[tracker->heading < 0] * bowden_rate(BOWDEN_Q50, speed);
#if BOWDEN_LOOP
    const double exponent = tracker->next.mean[BOWDEN_EXPONENT], taut = tracker->twice_preload * carries * exponent;
    const double along = tracker->heading * input_force, sign = along > 0.0 ? 1.0 : -1.0;
    const double grows = exp(-sign * carries * exponent), slack = along * (1.0 - grows);

    slope[0] = taut > slack ? tracker->twice_preload * carries : fabs(tracker->smooth) * grows * carries;
    slope[1] = taut > slack ? 1.0 : grows;
    slope[2] = 1.0;
    return tracker->heading * (input_force - output_force) - fmax(taut, slack) + slope[0] * exponent;
#else
    slope[0] = carries;
#if BOWDEN_LOAD_DEPENDENT
    slope[1] = pow((tracker->smooth + bowden_load[BOWDEN_Q50][1]) / BOWDEN_REFERENCE_FORCE, bowden_load[BOWDEN_Q50][0] - 1.0)
               / BOWDEN_REFERENCE_FORCE;
    slope[2] = pow((tracker->smooth_output + bowden_load[BOWDEN_Q50][1]) / BOWDEN_REFERENCE_FORCE,
                   bowden_load[BOWDEN_Q50][0] - 1.0) / BOWDEN_REFERENCE_FORCE;
    return tracker->heading * (bowden_scale(BOWDEN_Q50, input_force) - bowden_scale(BOWDEN_Q50, output_force));
#else
    slope[1] = 1.0 / tracker->smooth;
    slope[2] = 1.0 / tracker->smooth_output;
    return tracker->heading * log(input_force / output_force);
#endif
#endif
}

/* Learn from a sample in which the rope slides. */
static inline void bowden_track_learn(
    bowden_tracker *tracker, double speed, double input_force, double output_force, double seconds)
{
    const bowden_sensors *sensors = &tracker->sensors;
    bowden_estimate *next = &tracker->next;
    const int heading = tracker->heading;
    double slope[3], row[BOWDEN_STATES], considered[BOWDEN_CONSIDERED], lag;
    const double reading = bowden_track_reading(tracker, speed, input_force, output_force, slope);
    const double move = heading * slope[1] * tracker->rate; /* of the input per second, on the scale of friction */
    const double slip = move - slope[0] * next->mean[BOWDEN_EXPONENT] * tracker->growth; /* of the output */
    const double noise = sensors->force_sd * sqrt(slope[1] * slope[1] + slope[2] * slope[2]);
    const double white = sensors->noise_time > 0.0 ? 0.1 * noise : noise;

    if (!(slip > 0.0) || !(slope[0] > 0.0)) {
        return; /* friction that depends on speed may grow faster than the force, before a reversal: the rope sticks */
    }
    /* The exponent may rise faster, too, and the rope stick for moments: the mean of reflected Brownian motion. */
    lag = slope[0] * slope[0] * tracker->drift * tracker->drift / (2.0 * slip);
    row[BOWDEN_NOISE] = sensors->noise_time > 0.0 ? noise : 0.0;
    row[BOWDEN_EXPONENT] = slope[0];
    row[BOWDEN_GAIN] = -heading * slope[2] * tracker->smooth_output;
    considered[BOWDEN_ZERO_IN] = heading * slope[1];
    considered[BOWDEN_ZERO_OUT] = -heading * slope[2];
    considered[BOWDEN_LATENCY] = move;
    bowden_estimate_learn(next, row, considered, reading + lag,
                          white * white + lag * lag * (1.0 + 4.0 * lag / (slip * seconds)), tracker->considered);
    next->mean[BOWDEN_EXPONENT] = fmax(next->mean[BOWDEN_EXPONENT], 0.0);
    tracker->sample_sd = noise / slope[0];
}

/* Filter the forces, and tell how fast the input force moves, and friction grows by its dependence on speed. */
static inline void bowden_track_filter(
    bowden_tracker *tracker, double speed, double input_force, double output_force, double seconds)
{
    const double time = fmax(BOWDEN_RATE_TIME, 2.0 * seconds) + seconds;
    const double factor = log(bowden_rate(BOWDEN_Q50, speed));

    if (isnan(tracker->smooth)) {
        tracker->smooth = tracker->smoother = input_force;
        tracker->smooth_output = output_force;
        tracker->factor = tracker->smooth_factor = factor;
    }
    tracker->factor += (factor - tracker->factor) * seconds / time;
    tracker->growth = (tracker->factor - tracker->smooth_factor) / time;
    tracker->smooth_factor += tracker->growth * seconds;
    tracker->smooth += (input_force - tracker->smooth) * seconds / time;
    tracker->smooth_output += (output_force - tracker->smooth_output) * seconds / time;
    tracker->rate = (tracker->smooth - tracker->smoother) / time;
    tracker->smoother += tracker->rate * seconds;
}

/*
 * Take a sample, seconds (above 0) after the one before; returns the friction exponent. Samples with a force that is NAN teach
 * nothing, and as little do those in which nothing slides, or in which a force of a single rope is below ten standard
 * deviations of its noise.
 */
static inline double bowden_track(
    bowden_tracker *tracker, double speed, double input_force, double output_force, double seconds)
{
    const double clear = 10.0 * tracker->sensors.force_sd;

    tracker->sliding = 0;
    if (seconds > 0.0) {
        bowden_estimate_wait(&tracker->counted, tracker, seconds);
        bowden_estimate_wait(&tracker->next, tracker, seconds);
        tracker->stroke_variance += tracker->drift * tracker->drift * seconds;
    }
    if (!(seconds > 0.0) || !(fabs(input_force) < INFINITY) || !(fabs(output_force) < INFINITY)
        || (BOWDEN_RATE_DEPENDENT && isnan(speed)) || (!BOWDEN_LOOP && (input_force < clear || output_force < clear))) {
        return tracker->counted.mean[BOWDEN_EXPONENT];
    }
    if (bowden_track_slides(tracker, input_force, output_force)) {
        tracker->sliding = 1;
        bowden_track_learn(tracker, speed, input_force, output_force, seconds);
        if (tracker->heading * (input_force - tracker->counted_force) > clear) {
            tracker->counted_force = input_force;
            tracker->counted = tracker->next;
        }
    }
    bowden_track_filter(tracker, speed, input_force, output_force, seconds);
    return tracker->counted.mean[BOWDEN_EXPONENT];
}

/* Mean of n squares of standard normal numbers that chance exceeds once in some ten thousand times. */
static inline double bowden_track_limit(int n)
{
    return 1.0 + 5.5 / sqrt(n) + 8.0 / n;
}

/* The 90 % interval of the friction exponent; returns 0, or BOWDEN_CANNOT_TELL. */
static inline int bowden_track_interval(const bowden_tracker *tracker, double *low, double *high)
{
    const bowden_estimate *counted = &tracker->counted;
    double variance = bowden_estimate_variance(counted, BOWDEN_EXPONENT), worst = 0.0;
    int i, k, flag = 0;

    for (k = 0; k < BOWDEN_CONSIDERED; k++) {
        const double shift = counted->shift[k][BOWDEN_EXPONENT] * tracker->considered[k];

        variance += shift * shift;
    }
    for (i = 0; i < BOWDEN_SPANS; i++) {
        if (counted->sums[i] && counted->capped[i] > bowden_track_limit(counted->sums[i])) {
            flag = BOWDEN_CANNOT_TELL;
            worst = fmax(worst, counted->ratio[i]);
        }
    }
    if (flag) {
        variance = worst * (variance + tracker->sample_sd * tracker->sample_sd);
    }
    if (tracker->strokes > 0 && (tracker->disagreement > bowden_track_limit(tracker->strokes)
                             || tracker->alternates < -4.0 / sqrt(tracker->strokes) - 8.0 / tracker->strokes)) {
        flag = BOWDEN_CANNOT_TELL;
        variance += 0.25 * tracker->moved; /* an error that changes its sign with each stroke is half the move */
    }
    *low = fmax(counted->mean[BOWDEN_EXPONENT] - 1.645 * sqrt(variance), 0.0);
    *high = counted->mean[BOWDEN_EXPONENT] + 1.645 * sqrt(variance);
    return flag;
}
