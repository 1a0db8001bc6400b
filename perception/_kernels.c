/* Perception's hot functions: see the Python functions of the same names in sweep.py, lines.py, compass.py, exit.py,
 * space.py, hough.py, mapping/matching.py. */
#include "../transport/kernels.h"

#include <stdlib.h>

static PyObject *sort_readings(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array ranges;
    double bounds[2];
    if (!takes("sort_readings", 3, count) || !numbers(arguments + 1, 2, bounds) ||
        !opened(arguments[0], &ranges, "d", PyBUF_WRITABLE))
        return NULL;
    double shortest = bounds[0], reach = bounds[1];
    for (Py_ssize_t beam = 0; beam < ranges.columns; beam++) {
        double reading = NUMBER(ranges, beam);
        if (reading >= shortest && reading < reach)
            continue;
        if (reading == -INFINITY)
            NUMBER(ranges, beam) = shortest;
        else if (!isnan(reading))
            NUMBER(ranges, beam) = INFINITY;
        else
            NUMBER(ranges, beam) = NAN;
    }
    closed(&ranges);
    Py_RETURN_NONE;
}

static PyObject *points_of(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Beams beams;
    Array points;
    double place[2];
    if (!takes("points_of", 4, count) || !of_tuple(arguments[3], 2, place) || !beams_opened(arguments, &beams))
        return NULL;
    PyObject *found = made(&points, 2, beams.ranges.columns);
    if (found) {
        int beside = place[0] != 0.0 || place[1] != 0.0;
        for (Py_ssize_t beam = 0; beam < beams.ranges.columns; beam++) {
            double range = NUMBER(beams.ranges, beam);
            double x = range * NUMBER(beams.cosines, beam), y = range * NUMBER(beams.sines, beam);
            ENTRY(points, 0, beam) = beside ? x + place[0] : x;
            ENTRY(points, 1, beam) = beside ? y + place[1] : y;
        }
        closed(&points);
    }
    beams_closed(&beams);
    return found;
}

static PyObject *any_nearer(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array distances;
    double reach;
    int found = 0;
    if (!takes("any_nearer", 2, count) || !numbers(arguments + 1, 1, &reach) || !opened(arguments[0], &distances, "d", 0))
        return NULL;
    for (Py_ssize_t hit = 0; hit < distances.columns; hit++)
        found |= NUMBER(distances, hit) < reach;
    closed(&distances);
    return PyBool_FromLong(found);
}

static PyObject *all_hit(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array ranges;
    int found = 1;
    if (!takes("all_hit", 1, count) || !opened(arguments[0], &ranges, "d", 0))
        return NULL;
    for (Py_ssize_t beam = 0; beam < ranges.columns; beam++)
        found &= fabs(NUMBER(ranges, beam)) < INFINITY;
    closed(&ranges);
    return PyBool_FromLong(found);
}

static PyObject *out_of_view(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, hidden;
    double view[7];
    PyObject *found = NULL;
    if (!takes("out_of_view", 2, count) || !of_tuple(arguments[1], 7, view) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    Py_ssize_t kept = 0;
    char *blind = malloc(points.rows + 1);
    if (!blind) {
        PyErr_NoMemory();
    } else if (points.rows && points.columns != 2) {
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2)");
    } else {
        for (Py_ssize_t point = 0; point < points.rows; point++) {
            blind[point] = !in_view(ENTRY(points, point, 0), ENTRY(points, point, 1), view);
            kept += blind[point];
        }
        found = made(&hidden, kept, 2);
    }
    if (found) {
        Py_ssize_t row = 0;
        for (Py_ssize_t point = 0; point < points.rows; point++)
            if (blind[point]) {
                ENTRY(hidden, row, 0) = ENTRY(points, point, 0);
                ENTRY(hidden, row, 1) = ENTRY(points, point, 1);
                row++;
            }
        closed(&hidden);
    }
    free(blind);
    closed(&points);
    return found;
}

/* Adds (first, last) to a list; 0 with an exception set. */
static int added(PyObject *list, Py_ssize_t first, Py_ssize_t last)
{
    PyObject *pair = Py_BuildValue("(nn)", first, last);
    int done = pair && PyList_Append(list, pair) == 0;
    Py_XDECREF(pair);
    return done;
}

static PyObject *runs_of(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, ranges, beams;
    double given[3];
    PyObject *found = NULL;
    if (!takes("runs_of", 4, count) || !of_tuple(arguments[3], 3, given) || !opened(arguments[0], &points, "d", 0))
        return NULL;
    if (!opened(arguments[1], &ranges, "d", 0))
        goto points_open;
    if (!opened_indices(arguments[2], &beams))
        goto ranges_open;
    Py_ssize_t hits = points.rows, first = 0, missing = (Py_ssize_t)given[2];
    if (points.columns != 2 || ranges.columns != hits || beams.columns != hits) {
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2), ranges and beams (n,)");
        goto beams_open;
    }
    found = PyList_New(0);
    for (Py_ssize_t hit = 0; found && hit + 1 < hits; hit++) {
        double dx = ENTRY(points, hit + 1, 0) - ENTRY(points, hit, 0);
        double dy = ENTRY(points, hit + 1, 1) - ENTRY(points, hit, 1);
        double nearer = lesser(NUMBER(ranges, hit + 1), NUMBER(ranges, hit));
        double apart = nearer * nearer * given[0] + given[1];
        if (dx * dx + dy * dy > apart * apart || INDEX(beams, hit + 1) - INDEX(beams, hit) > missing + 1) {
            if (!added(found, first, hit))
                Py_CLEAR(found);
            first = hit + 1;
        }
    }
    if (found && !added(found, first, hits - 1))
        Py_CLEAR(found);
beams_open:
    closed(&beams);
ranges_open:
    closed(&ranges);
points_open:
    closed(&points);
    return found;
}

/* Reads (first, last) of a list's entry with 0 <= first <= last < limit; 0 with an exception set. */
static int pair_of(PyObject *list, Py_ssize_t index, Py_ssize_t limit, Py_ssize_t *first, Py_ssize_t *last)
{
    PyObject *pair = PyList_GetItem(list, index);
    if (!pair || !PyTuple_Check(pair) || PyTuple_Size(pair) != 2) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a list of pairs here");
        return 0;
    }
    *first = PyLong_AsSsize_t(PyTuple_GetItem(pair, 0));
    *last = PyLong_AsSsize_t(PyTuple_GetItem(pair, 1));
    if (PyErr_Occurred())
        return 0;
    if (*first < 0 || *last < *first || *last >= limit) {
        PyErr_SetString(PyExc_ValueError, "first and last are indices of points, in this order");
        return 0;
    }
    return 1;
}

/* The point farthest from the chord from first to last, or -1 where none is farther than the tolerance. */
static Py_ssize_t farthest_from_chord(const Array *points, Py_ssize_t first, Py_ssize_t last, double tolerance)
{
    double dx = ENTRY(*points, last, 0) - ENTRY(*points, first, 0);
    double dy = ENTRY(*points, last, 1) - ENTRY(*points, first, 1);
    int level = fabs(dx) >= fabs(dy) ? 0 : 1;
    double run = level ? dy : dx, rise = level ? dx : dy;
    double slope = run != 0.0 ? rise / run : 0.0;
    double chord = ENTRY(*points, first, level) * slope - ENTRY(*points, first, 1 - level);
    double high = chord, low = chord;
    Py_ssize_t highest = first, lowest = first;
    for (Py_ssize_t hit = first + 1; hit < last; hit++) {
        double across = ENTRY(*points, hit, level) * slope - ENTRY(*points, hit, 1 - level);
        if (across > high)
            high = across, highest = hit;
        if (across < low)
            low = across, lowest = hit;
    }
    double above = high - chord, below = chord - low;
    if (greater(above, below) <= tolerance * norm(1.0, slope))
        return -1;
    return above >= below ? highest : lowest;
}

/* Splits the points from first to last and adds the pieces to a list in order; 0 with an exception set. */
static int split_run(const Array *points, Py_ssize_t first, Py_ssize_t last, double tolerance, Py_ssize_t min_step,
                     Py_ssize_t *waiting, PyObject *pieces)
{
    Py_ssize_t ends = 0; /* last points of the parts that wait; each begins where the one before it ends */
    for (;;) {
        Py_ssize_t farthest = last - first < min_step ? -2 : farthest_from_chord(points, first, last, tolerance);
        if (farthest >= 0) {
            if (farthest <= first || farthest >= last) {
                PyErr_SetString(PyExc_ValueError, "the points are not all finite, or the tolerance is negative");
                return 0;
            }
            waiting[ends++] = last;
            last = farthest;
            continue;
        }
        if (farthest == -1 && !added(pieces, first, last))
            return 0;
        if (!ends)
            return 1;
        first = last;
        last = waiting[--ends];
    }
}

static PyObject *split_at_end_points(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double tolerance;
    if (!takes("split_at_end_points", 4, count) || !numbers(arguments + 2, 1, &tolerance))
        return NULL;
    Py_ssize_t min_step = PyLong_AsSsize_t(arguments[3]);
    if (PyErr_Occurred() || !opened(arguments[0], &points, "d", 0))
        return NULL;
    PyObject *pieces = PyList_New(0);
    Py_ssize_t *waiting = malloc((points.rows + 1) * sizeof(Py_ssize_t));
    int good = pieces != NULL && waiting != NULL;
    if (pieces && !waiting)
        PyErr_NoMemory();
    if (good && points.columns != 2) {
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2)");
        good = 0;
    }
    if (good && !PyList_Check(arguments[1])) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a list of pairs here");
        good = 0;
    }
    for (Py_ssize_t run = 0; good && run < PyList_Size(arguments[1]); run++) {
        Py_ssize_t first, last;
        good = pair_of(arguments[1], run, points.rows, &first, &last) &&
               split_run(&points, first, last, tolerance, min_step > 1 ? min_step : 1, waiting,
                         pieces);
    }
    free(waiting);
    closed(&points);
    if (!good)
        Py_CLEAR(pieces);
    return pieces;
}

/* A straight piece: its hits and the sums over them of the weights w and of their products. */
typedef struct {
    Py_ssize_t first, last;
    double sums[6];
} Piece;

enum { W, WX, WY, WXX, WXY, WYY };

/* Adds numbers up in the order of numpy's sums: eight at a time in blocks of up to 128. */
static double summed(const double *terms, Py_ssize_t count)
{
    if (count < 8) {
        double sum = -0.0;
        for (Py_ssize_t index = 0; index < count; index++)
            sum += terms[index];
        return sum;
    }
    if (count > 128) {
        Py_ssize_t half = count / 2;
        half -= half % 8;
        return summed(terms, half) + summed(terms + half, count - half);
    }
    double part[8];
    Py_ssize_t index;
    memcpy(part, terms, sizeof(part));
    for (index = 8; index < count - count % 8; index += 8)
        for (int lane = 0; lane < 8; lane++)
            part[lane] += terms[index + lane];
    double sum = ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]));
    for (; index < count; index++)
        sum += terms[index];
    return sum;
}

/* The sums of the hits between first and last; `terms` has room for six numbers a hit. */
static void weigh(const Array *points, const Array *distances, Py_ssize_t first, Py_ssize_t last, double *terms,
                  Piece *piece)
{
    Py_ssize_t begin = first + 1, hits = last > begin ? last - begin : 1;
    for (Py_ssize_t hit = 0; hit < hits; hit++) {
        double x = ENTRY(*points, begin + hit, 0), y = ENTRY(*points, begin + hit, 1);
        double distance = NUMBER(*distances, begin + hit);
        double w = distance * distance + 1e-30;
        double wx = x * w, wy = y * w;
        terms[W * hits + hit] = w;
        terms[WX * hits + hit] = wx;
        terms[WY * hits + hit] = wy;
        terms[WXX * hits + hit] = x * wx;
        terms[WXY * hits + hit] = y * wx;
        terms[WYY * hits + hit] = y * wy;
    }
    piece->first = first + 1, piece->last = last - 1;
    for (int which = W; which <= WYY; which++)
        piece->sums[which] = hits > 1 ? terms[which * hits] + summed(terms + which * hits + 1, hits - 1)
                                      : terms[which * hits];
}

static Piece joined(const Piece *one, const Piece *other)
{
    Piece both = {one->first, other->last, {0}};
    for (int which = W; which <= WYY; which++)
        both.sums[which] = one->sums[which] + other->sums[which];
    return both;
}

static void scatter(const Piece *piece, double *cxx, double *cxy, double *cyy)
{
    const double *sums = piece->sums;
    *cxx = sums[WXX] - sums[WX] * sums[WX] / sums[W];
    *cxy = sums[WXY] - sums[WX] * sums[WY] / sums[W];
    *cyy = sums[WYY] - sums[WY] * sums[WY] / sums[W];
}

static double deviation(const Piece *piece)
{
    double cxx, cxy, cyy;
    scatter(piece, &cxx, &cxy, &cyy);
    double across = (cxx + cyy) / 2 - norm((cxx - cyy) / 2, cxy);
    return sqrt(greater(across, 0.0) / piece->sums[W]);
}

static double excess(const Piece *one, const Piece *other)
{
    if (other->first - one->last != 2)
        return INFINITY;
    Piece both = joined(one, other);
    return deviation(&both) - 1.2 * greater(deviation(one), deviation(other));
}

/* Puts neighbours together that one line fits about as well as two, the best pair first; how many pieces are left. */
static Py_ssize_t merged(Piece *pieces, double *excesses, Py_ssize_t count, double limit)
{
    for (Py_ssize_t index = 0; index + 1 < count; index++)
        excesses[index] = excess(pieces + index, pieces + index + 1);
    while (count > 1) {
        Py_ssize_t best = 0;
        for (Py_ssize_t index = 1; index + 1 < count; index++)
            if (excesses[index] < excesses[best])
                best = index;
        if (!(excesses[best] <= limit))
            break;
        pieces[best] = joined(pieces + best, pieces + best + 1);
        for (Py_ssize_t index = best + 1; index + 1 < count; index++) {
            pieces[index] = pieces[index + 1];
            excesses[index - 1] = excesses[index];
        }
        count--;
        for (Py_ssize_t index = best > 0 ? best - 1 : 0; index <= best && index + 1 < count; index++)
            excesses[index] = excess(pieces + index, pieces + index + 1);
    }
    return count;
}

typedef struct {
    double x, y;
} Place;

static Place onto(const Array *points, Py_ssize_t hit, double cosine, double sine, double p)
{
    double x = ENTRY(*points, hit, 0), y = ENTRY(*points, hit, 1);
    double away = x * cosine + y * sine - p;
    return (Place){x - away * cosine, y - away * sine};
}

/* The line of a piece as a tuple; None where it is too short or too crooked. */
static PyObject *fitted(const Array *points, const Piece *piece, double min_length, double max_residual)
{
    double cxx, cxy, cyy, cosine, sine;
    const double *sums = piece->sums;
    scatter(piece, &cxx, &cxy, &cyy);
    halfway(cyy - cxx, -2 * cxy, &cosine, &sine);
    double p = (sums[WX] * cosine + sums[WY] * sine) / sums[W];
    if (p < 0)
        cosine = -cosine, sine = -sine, p = -p;
    double along = norm(cxx - cyy, 2 * cxy);
    double across = greater((cxx + cyy - along) / 2, 0.0);
    double away = greater(p, 0.02);
    Place start = onto(points, piece->first, cosine, sine, p), end = onto(points, piece->last, cosine, sine, p);
    double length = norm(start.x - end.x, start.y - end.y), residual = sqrt(across / sums[W]);
    if (!(length >= min_length && residual <= max_residual))
        Py_RETURN_NONE;
    return Py_BuildValue("(dd(dd)(dd)dndd)", direction(sine, cosine), p, start.x, start.y, end.x, end.y, length,
                         piece->last - piece->first + 1, (along + across) / (away * away), residual);
}

static PyObject *fitted_lines(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, distances;
    double limits[3];
    PyObject *lines = NULL;
    Piece *pieces = NULL;
    double *terms = NULL;
    if (!takes("fitted_lines", 4, count) || !of_tuple(arguments[3], 3, limits))
        return NULL;
    if (!PyList_Check(arguments[2])) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a list of pairs here");
        return NULL;
    }
    if (!opened(arguments[0], &points, "d", 0))
        return NULL;
    if (!opened(arguments[1], &distances, "d", 0))
        goto points_open;
    Py_ssize_t hits = points.rows, total = PyList_Size(arguments[2]);
    if (points.columns != 2 || distances.columns != hits) {
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2), distances (n,)");
        goto distances_open;
    }
    pieces = malloc((total + 1) * sizeof(Piece));
    terms = malloc(((hits + 1) * 6 + total) * sizeof(double));
    if (!pieces || !terms) {
        PyErr_NoMemory();
        goto distances_open;
    }
    for (Py_ssize_t index = 0; index < total; index++) {
        Py_ssize_t first, last;
        if (!pair_of(arguments[2], index, hits, &first, &last))
            goto distances_open;
        if (last == first) {
            PyErr_SetString(PyExc_ValueError, "a piece has two hits at least");
            goto distances_open;
        }
        weigh(&points, &distances, first, last, terms, pieces + index);
    }
    total = merged(pieces, terms, total, limits[0]);
    lines = PyList_New(0);
    for (Py_ssize_t index = 0; lines && index < total; index++) {
        PyObject *line = fitted(&points, pieces + index, limits[1], limits[2]);
        if (!line || (line != Py_None && PyList_Append(lines, line) < 0))
            Py_CLEAR(lines);
        Py_XDECREF(line);
    }
distances_open:
    free(terms);
    free(pieces);
    closed(&distances);
points_open:
    closed(&points);
    return lines;
}

/* Python's `math.fsum`: the sum of numbers, rounded once. Sums of nonoverlapping parts (Shewchuk, 1997). */
static double exact_sum(const double *terms, Py_ssize_t count)
{
    double parts[64], plain = 0.0, sum = 0.0, rest = 0.0;
    int used = 0;
    for (Py_ssize_t index = 0; index < count; index++)
        plain += terms[index];
    if (!isfinite(plain))
        return plain;
    for (Py_ssize_t index = 0; index < count; index++) {
        double x = terms[index];
        int kept = 0;
        for (int part = 0; part < used; part++) {
            double y = parts[part];
            if (fabs(x) < fabs(y)) {
                double larger = y;
                y = x, x = larger;
            }
            double high = x + y, low = y - (high - x);
            if (low != 0.0)
                parts[kept++] = low;
            x = high;
        }
        parts[kept++] = x;
        used = kept;
    }
    if (used)
        sum = parts[--used];
    while (used && rest == 0.0) {
        double x = sum, y = parts[--used];
        sum = x + y;
        rest = y - (sum - x);
    }
    /* What is left over decides where the sum is halfway between two numbers. */
    if (used && ((rest < 0.0 && parts[used - 1] < 0.0) || (rest > 0.0 && parts[used - 1] > 0.0))) {
        double twice = rest * 2.0, rounded = sum + twice;
        if (twice == rounded - sum)
            sum = rounded;
    }
    return sum;
}

/* The first of the walls with which most of the others agree; `terms` has room for a number a wall. */
static Py_ssize_t named_by_most(const double *alphas, const double *lengths, Py_ssize_t count, double world_angle,
                                double spread, double *terms)
{
    Py_ssize_t other = 0, best = 0;
    double most = -INFINITY;
    while (other < count && fabs(remainder(alphas[other] - alphas[0], world_angle)) <= spread)
        other++;
    if (other == count)
        return 0;
    for (Py_ssize_t index = 0; index < count; index++) {
        for (other = 0; other < count; other++) {
            double offset = alphas[index] - alphas[other];
            int near = fabs(offset - world_angle * rint(offset / world_angle)) <= spread;
            terms[other] = near * (lengths[other] * lengths[other]);
        }
        double weight = summed(terms, count);
        if (weight > most)
            most = weight, best = index;
    }
    return best;
}

static PyObject *agreed_direction(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double limits[4];
    if (!takes("agreed_direction", 2, count) || !of_tuple(arguments[1], 4, limits))
        return NULL;
    Py_ssize_t walls = PyTuple_Check(arguments[0]) ? PyTuple_Size(arguments[0]) : 0, agreeing = 0;
    double *alphas = malloc((walls + 1) * 6 * sizeof(double));
    PyObject *found = NULL;
    if (!alphas)
        return PyErr_NoMemory();
    double *lengths = alphas + walls, *information = lengths + walls;
    double *first = information + walls, *second = first + walls, *third = second + walls;
    int good = walls > 0;
    if (!good)
        PyErr_SetString(PyExc_TypeError, "a kernel takes a tuple of lines here");
    for (Py_ssize_t wall = 0; good && wall < walls; wall++) {
        PyObject *line = PyTuple_GetItem(arguments[0], wall);
        good = PyTuple_Check(line) && PyTuple_Size(line) == 8;
        if (!good)
            PyErr_SetString(PyExc_TypeError, "a line has eight fields");
        PyObject *fields[3] = {NULL, NULL, NULL};
        double given[3];
        for (int field = 0; good && field < 3; field++)
            fields[field] = PyTuple_GetItem(line, field == 0 ? 0 : 2 * field + 2);
        good = good && numbers(fields, 3, given);
        if (good)
            alphas[wall] = given[0], lengths[wall] = given[1], information[wall] = given[2];
    }
    if (!good)
        goto done;
    double world_angle = limits[0], spread = limits[1];
    double named = alphas[named_by_most(alphas, lengths, walls, world_angle, spread, first)];
    for (Py_ssize_t wall = 0; wall < walls; wall++)
        third[wall] = lengths[wall] * lengths[wall];
    double whole = exact_sum(third, walls);
    for (Py_ssize_t wall = 0; wall < walls; wall++) {
        double offset = remainder(alphas[wall] - named, world_angle);
        if (!(fabs(offset) <= spread))
            continue;
        lengths[agreeing] = lengths[wall];
        third[agreeing] = lengths[wall] * lengths[wall];
        first[agreeing] = lesser(information[wall], 1e12);
        second[agreeing] = first[agreeing] * offset;
        agreeing++;
    }
    double confidence = exact_sum(third, agreeing) / whole;
    if (exact_sum(lengths, agreeing) < limits[2] || confidence < limits[3]) {
        found = Py_None;
        Py_INCREF(found);
        goto done;
    }
    double total = exact_sum(first, agreeing), mean = exact_sum(second, agreeing) / total;
    double misalignment = remainder(named + mean - 3.141592653589793 / 2, world_angle);
    found = Py_BuildValue("(ddd)", misalignment, confidence, total);
done:
    free(alphas);
    return found;
}

static PyObject *along_lane(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, found;
    double turn[2], bounds[2];
    if (!takes("along_lane", 3, count) || !of_tuple(arguments[1], 2, turn) || !of_tuple(arguments[2], 2, bounds) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    Py_ssize_t inside = 0, at = 0;
    if (points.columns != 2) {
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2)");
        closed(&points);
        return NULL;
    }
    for (Py_ssize_t hit = 0; hit < points.rows; hit++) {
        double x = ENTRY(points, hit, 0) * turn[0] + ENTRY(points, hit, 1) * turn[1];
        inside += x >= bounds[0] && x <= bounds[1];
    }
    PyObject *object = made(&found, 2, inside);
    if (object) {
        for (Py_ssize_t hit = 0; hit < points.rows; hit++) {
            double x = ENTRY(points, hit, 0) * turn[0] + ENTRY(points, hit, 1) * turn[1];
            if (!(x >= bounds[0] && x <= bounds[1]))
                continue;
            ENTRY(found, 0, at) = x;
            ENTRY(found, 1, at) = ENTRY(points, hit, 1) * turn[0] - ENTRY(points, hit, 0) * turn[1];
            at++;
        }
        closed(&found);
    }
    closed(&points);
    return object;
}

/* The number of hits that may be bad readings, as in exit.py. */
#define STRAY 2

/* Keeps the STRAY + 1 largest numbers, the largest first. */
static inline void keep_largest(double *largest, double value)
{
    for (int place = 0; place <= STRAY; place++)
        if (value > largest[place]) {
            double lower = largest[place];
            largest[place] = value;
            value = lower;
        }
}

/* How many hits are between two bounds across the lane, and how far ahead the last of them is but for stray ones. */
static Py_ssize_t stretch(const Array *hits, double low, double high, double *last)
{
    double largest[STRAY + 1];
    Py_ssize_t inside = 0;
    for (int place = 0; place <= STRAY; place++)
        largest[place] = -INFINITY;
    for (Py_ssize_t hit = 0; hit < hits->columns; hit++) {
        double y = ENTRY(*hits, 1, hit);
        if (y < high && y > low) {
            inside++;
            keep_largest(largest, ENTRY(*hits, 0, hit));
        }
    }
    if (inside > STRAY)
        *last = largest[STRAY];
    return inside;
}

static PyObject *in_lane(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array hits;
    double given[3];
    if (!takes("in_lane", 4, count) || !numbers(arguments + 1, 3, given) || !opened(arguments[0], &hits, "d", 0))
        return NULL;
    Py_ssize_t inside = stretch(&hits, given[0], given[1], given + 2);
    closed(&hits);
    return Py_BuildValue("(nd)", inside, given[2]);
}

/* The lane between the walls on both sides: to the left, to the right and ahead; 0 where there is none. `sizes` are the
   numbers that lane_beside is given. */
static int beside(const Array *hits, const double *sizes, double *found)
{
    double half_width = sizes[0], close = sizes[1], most = sizes[2], widening = sizes[3];
    /* The lowest from the bound on at each side, negated: the largest are kept. */
    double left[STRAY + 1], right[STRAY + 1];
    Py_ssize_t ahead = 0;
    for (int place = 0; place <= STRAY; place++)
        left[place] = right[place] = -INFINITY;
    for (Py_ssize_t hit = 0; hit < hits->columns; hit++) {
        double x = ENTRY(*hits, 0, hit), y = ENTRY(*hits, 1, hit);
        if (!(fabs(x) <= close))
            continue;
        ahead += x > 0.0 && fabs(y) < half_width;
        if (y >= half_width)
            keep_largest(left, -y);
        if (-y >= half_width)
            keep_largest(right, y);
    }
    found[0] = -left[STRAY], found[1] = -right[STRAY], found[2] = INFINITY;
    if (ahead > STRAY || greater(found[0], found[1]) > most)
        return 0;
    stretch(hits, -found[1] - widening, found[0] + widening, found + 2);
    return 1;
}

static PyObject *lane_beside(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array hits;
    double sizes[4], found[3];
    if (!takes("lane_beside", 5, count) || !numbers(arguments + 1, 4, sizes) || !opened(arguments[0], &hits, "d", 0))
        return NULL;
    int between = beside(&hits, sizes, found);
    closed(&hits);
    if (!between)
        Py_RETURN_NONE;
    return Py_BuildValue("(ddd)", found[0], found[1], found[2]);
}

static PyObject *lane_in_sight(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double turn[2], bounds[2], sizes[4], before[2], last = INFINITY, found[3];
    if (!takes("lane_in_sight", 5, count) || !of_tuple(arguments[1], 2, turn) || !of_tuple(arguments[2], 2, bounds) ||
        !of_tuple(arguments[3], 4, sizes) || !of_tuple(arguments[4], 2, before) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    double *along = malloc((points.rows + 1) * 2 * sizeof(double));
    if (!along || points.columns != 2) {
        if (along)
            PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2)");
        else
            PyErr_NoMemory();
        free(along);
        closed(&points);
        return NULL;
    }
    Py_ssize_t inside = 0;
    for (Py_ssize_t hit = 0; hit < points.rows; hit++) {
        double x = ENTRY(points, hit, 0), y = ENTRY(points, hit, 1), ahead = x * turn[0] + y * turn[1];
        along[2 * inside] = ahead;
        along[2 * inside + 1] = y * turn[0] - x * turn[1];
        inside += ahead >= bounds[0] && ahead <= bounds[1];
    }
    closed(&points);
    Array hits = {.data = (char *)along, .rows = 2, .columns = inside, .row_step = sizeof(double),
                  .column_step = 2 * sizeof(double)};
    Py_ssize_t standing = stretch(&hits, -before[1] - sizes[3], before[0] + sizes[3], &last);
    int between = beside(&hits, sizes, found);
    free(along);
    return between ? Py_BuildValue("((ddd)nd)", found[0], found[1], found[2], standing, last)
                   : Py_BuildValue("(Ond)", Py_None, standing, last);
}

static int by_size(const void *one, const void *other)
{
    double difference = *(const double *)one - *(const double *)other;
    return (difference > 0) - (difference < 0);
}

static PyObject *seen_in_sector(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array ranges, beams;
    double share, distance = NAN;
    if (!takes("seen_in_sector", 3, count) || !numbers(arguments + 2, 1, &share) ||
        !opened(arguments[0], &ranges, "d", 0))
        return NULL;
    if (!opened_indices(arguments[1], &beams)) {
        closed(&ranges);
        return NULL;
    }
    Py_ssize_t known = 0, total = beams.columns;
    double *sorted = malloc((total + 1) * sizeof(double));
    int good = sorted != NULL;
    if (!good)
        PyErr_NoMemory();
    for (Py_ssize_t index = 0; good && index < total; index++) {
        Py_ssize_t beam = INDEX(beams, index);
        good = beam >= 0 && beam < ranges.columns;
        if (!good)
            PyErr_SetString(PyExc_IndexError, "there is no such beam");
        else if (!isnan(NUMBER(ranges, beam)))
            sorted[known++] = NUMBER(ranges, beam);
    }
    if (good && known && 2 * known >= total) {
        qsort(sorted, known, sizeof(double), by_size);
        Py_ssize_t passed = (Py_ssize_t)(share * known);
        passed = passed > (known >= 3) ? passed : (known >= 3);
        distance = sorted[passed < known - 1 ? passed : known - 1];
    }
    free(sorted);
    closed(&beams);
    closed(&ranges);
    return good ? PyFloat_FromDouble(distance) : NULL;
}

static PyObject *count_votes(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array transform, columns, votes;
    if (!takes("count_votes", 3, count) || !opened(arguments[0], &transform, "f", 0))
        return NULL;
    if (!opened(arguments[1], &columns, "f", 0))
        goto transform_open;
    if (!opened(arguments[2], &votes, "i", PyBUF_WRITABLE))
        goto columns_open;
    int good = transform.columns == 3 && columns.rows == 2 && votes.rows == transform.rows &&
               votes.column_step == sizeof(int32_t) && columns.column_step == sizeof(float);
    const float *x = (const float *)columns.data, *y = (const float *)(columns.data + columns.row_step);
    for (Py_ssize_t row = 0; good && row < votes.rows; row++) {
        int32_t *cells = (int32_t *)(votes.data + row * votes.row_step);
        const char *line = transform.data + row * transform.row_step;
        float cosine = *(const float *)line, sine = *(const float *)(line + transform.column_step);
        float middle = *(const float *)(line + 2 * transform.column_step);
        memset(cells, 0, votes.columns * sizeof(int32_t));
        for (Py_ssize_t hit = 0; good && hit < columns.columns; hit++) {
            float number = cosine * x[hit];
            number += sine * y[hit];
            number += middle;
            good = number > -1.0f && number < (float)votes.columns;
            if (good)
                cells[(int32_t)number]++;
        }
    }
    if (!good)
        PyErr_SetString(PyExc_ValueError, "each hit is in one cell of each row of votes");
    closed(&votes);
    closed(&columns);
    closed(&transform);
    if (!good)
        return NULL;
    Py_RETURN_NONE;
columns_open:
    closed(&columns);
transform_open:
    closed(&transform);
    return NULL;
}

/* Points, normals and variances of a cloud, from a tuple; 0 with an exception set. */
typedef struct {
    Array points, normals, variances;
} Cloud;

static void cloud_closed(Cloud *cloud)
{
    closed(&cloud->variances);
    closed(&cloud->normals);
    closed(&cloud->points);
}

static int cloud_opened(PyObject *tuple, Cloud *cloud)
{
    if (!PyTuple_Check(tuple) || PyTuple_Size(tuple) != 3) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a tuple of three arrays here");
        return 0;
    }
    if (!opened(PyTuple_GetItem(tuple, 0), &cloud->points, "d", 0))
        return 0;
    if (!opened(PyTuple_GetItem(tuple, 1), &cloud->normals, "d", 0))
        goto points_open;
    if (!opened(PyTuple_GetItem(tuple, 2), &cloud->variances, "d", 0))
        goto normals_open;
    Py_ssize_t size = cloud->variances.columns;
    if (cloud->points.rows == 2 && cloud->normals.rows == 2 && cloud->points.columns == size &&
        cloud->normals.columns == size)
        return 1;
    PyErr_SetString(PyExc_ValueError, "points and normals have the shape (2, n), variances (n,)");
    closed(&cloud->variances);
normals_open:
    closed(&cloud->normals);
points_open:
    closed(&cloud->points);
    return 0;
}

static PyObject *on_walls(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Cloud scan, reference;
    Array apart, nearest, pairs;
    double place[5], cosine, sine;
    PyObject *found = NULL;
    if (!takes("on_walls", 5, count) || !of_tuple(arguments[4], 5, place) ||
        !cloud_opened(arguments[0], &scan))
        return NULL;
    if (!cloud_opened(arguments[1], &reference))
        goto scan_open;
    if (!opened(arguments[2], &apart, "d", 0))
        goto reference_open;
    if (!opened_indices(arguments[3], &nearest))
        goto apart_open;
    Py_ssize_t size = scan.variances.columns, kept = 0;
    Py_ssize_t *good = malloc((size + 1) * sizeof(Py_ssize_t));
    if (!good) {
        PyErr_NoMemory();
        goto nearest_open;
    }
    if (apart.columns != size || nearest.columns != size) {
        PyErr_SetString(PyExc_ValueError, "each point has one neighbour");
        goto good_open;
    }
    cos_sin(place[2], &cosine, &sine);
    for (Py_ssize_t point = 0; point < size; point++) {
        if (!(NUMBER(apart, point) < INFINITY))
            continue;
        Py_ssize_t wall = INDEX(nearest, point);
        if (wall < 0 || wall >= reference.variances.columns) {
            PyErr_SetString(PyExc_IndexError, "there is no such wall");
            goto good_open;
        }
        double x = ENTRY(scan.points, 0, point), y = ENTRY(scan.points, 1, point);
        double nx = ENTRY(reference.normals, 0, wall), ny = ENTRY(reference.normals, 1, wall);
        double own_x = ENTRY(scan.normals, 0, point), own_y = ENTRY(scan.normals, 1, point);
        double beside_x = x * cosine - sine * y + place[0] - ENTRY(reference.points, 0, wall);
        double beside_y = y * cosine + sine * x + place[1] - ENTRY(reference.points, 1, wall);
        double off = beside_x * nx + beside_y * ny;
        double same = (own_x * cosine - sine * own_y) * nx + (own_y * cosine + sine * own_x) * ny;
        if (same >= place[4] && fabs(off) <= place[3])
            good[kept++] = point;
    }
    found = made(&pairs, 7, kept);
    for (Py_ssize_t pair = 0; found && pair < kept; pair++) {
        Py_ssize_t point = good[pair], wall = INDEX(nearest, point);
        for (int axis = 0; axis < 2; axis++) {
            ENTRY(pairs, axis, pair) = ENTRY(scan.points, axis, point);
            ENTRY(pairs, 2 + axis, pair) = ENTRY(reference.points, axis, wall);
            ENTRY(pairs, 4 + axis, pair) = ENTRY(reference.normals, axis, wall);
        }
        ENTRY(pairs, 6, pair) = NUMBER(scan.variances, point) + NUMBER(reference.variances, wall);
    }
    if (found)
        closed(&pairs);
good_open:
    free(good);
nearest_open:
    closed(&nearest);
apart_open:
    closed(&apart);
reference_open:
    cloud_closed(&reference);
scan_open:
    cloud_closed(&scan);
    return found;
}

/* The number that is at a place when numbers are sorted, which they are in part afterwards (Hoare's selection). */
static double selected(double *values, Py_ssize_t count, Py_ssize_t place)
{
    Py_ssize_t low = 0, high = count - 1;
    while (low < high) {
        double middle = values[low + (high - low) / 2];
        Py_ssize_t left = low, right = high;
        while (left <= right) {
            while (values[left] < middle)
                left++;
            while (middle < values[right])
                right--;
            if (left <= right) {
                double other = values[left];
                values[left++] = values[right];
                values[right--] = other;
            }
        }
        if (place <= right)
            high = right;
        else if (place >= left)
            low = left;
        else
            break;
    }
    return values[place];
}

static PyObject *normal_equations(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array pairs;
    double place[3], given[2], cosine, sine, sums[9];
    PyObject *found = NULL;
    if (!takes("normal_equations", 3, count) || !of_tuple(arguments[1], 3, place) ||
        !of_tuple(arguments[2], 2, given) || !opened(arguments[0], &pairs, "d", 0))
        return NULL;
    Py_ssize_t size = pairs.columns;
    double *off = malloc((size + 1) * 11 * sizeof(double));
    if (pairs.rows != 7 || size < 1) {
        PyErr_SetString(PyExc_ValueError, "pairs have the shape (7, n)");
        goto pairs_open;
    }
    if (!off) {
        PyErr_NoMemory();
        goto pairs_open;
    }
    double *ratio = off + size, *terms = off + 2 * size;
    cos_sin(place[2], &cosine, &sine);
    for (Py_ssize_t pair = 0; pair < size; pair++) {
        double x = ENTRY(pairs, 0, pair), y = ENTRY(pairs, 1, pair);
        double beside_x = x * cosine - sine * y + place[0] - ENTRY(pairs, 2, pair);
        double beside_y = y * cosine + sine * x + place[1] - ENTRY(pairs, 3, pair);
        off[pair] = beside_x * ENTRY(pairs, 4, pair) + beside_y * ENTRY(pairs, 5, pair);
        ratio[pair] = off[pair] / sqrt(ENTRY(pairs, 6, pair));
        terms[pair] = fabs(ratio[pair]);
    }
    double measured = greater(1.4826 * selected(terms, size, size / 2), 1.0);
    double narrow = 1.0 / (3.0 * given[0]), wide = measured * measured * given[1];
    cos_sin(-place[2], &cosine, &sine);
    for (Py_ssize_t pair = 0; pair < size; pair++) {
        double x = ENTRY(pairs, 0, pair), y = ENTRY(pairs, 1, pair);
        double normal_x = ENTRY(pairs, 4, pair), normal_y = ENTRY(pairs, 5, pair);
        double part = ratio[pair] * narrow;
        double weight = 1.0 / ((1.0 + part * part) * ENTRY(pairs, 6, pair) * wide);
        double nx = normal_x * cosine - sine * normal_y, ny = normal_y * cosine + sine * normal_x;
        double turn = x * ny - y * nx, last = off[pair];
        double along_x = nx * weight, along_y = ny * weight, along_turn = turn * weight;
        terms[pair] = along_x * nx;
        terms[size + pair] = along_x * ny;
        terms[2 * size + pair] = along_x * turn;
        terms[3 * size + pair] = along_x * last;
        terms[4 * size + pair] = along_y * ny;
        terms[5 * size + pair] = along_y * turn;
        terms[6 * size + pair] = along_y * last;
        terms[7 * size + pair] = along_turn * turn;
        terms[8 * size + pair] = along_turn * last;
    }
    for (int which = 0; which < 9; which++)
        sums[which] = 0.0 + summed(terms + which * size, size);
    found = Py_BuildValue("(dddddddddd)", sums[0], sums[1], sums[2], sums[4], sums[5], sums[7], sums[3], sums[6], sums[8],
                          measured);
pairs_open:
    free(off);
    closed(&pairs);
    return found;
}

static PyObject *extent_along(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double direction[2], rear = 0.0, lowest = 0.0, highest = 0.0;
    if (!takes("extent_along", 2, count) || !of_tuple(arguments[1], 2, direction))
        return NULL;
    Py_ssize_t corners = PyTuple_Check(arguments[0]) ? PyTuple_Size(arguments[0]) : 0;
    if (!corners) {
        PyErr_SetString(PyExc_TypeError, "an outline is a tuple of corners");
        return NULL;
    }
    for (Py_ssize_t corner = 0; corner < corners; corner++) {
        double place[2];
        if (!of_tuple(PyTuple_GetItem(arguments[0], corner), 2, place))
            return NULL;
        double along = place[0] * direction[0] + place[1] * direction[1];
        double across = place[1] * direction[0] - place[0] * direction[1];
        rear = corner ? lesser(rear, along) : along;
        lowest = corner ? lesser(lowest, across) : across;
        highest = corner ? greater(highest, across) : across;
    }
    return Py_BuildValue("(dd)", rear, greater(lesser(highest, -lowest), 0.0));
}

static PyMethodDef kernels[] = {
    KERNEL(sort_readings),
    KERNEL(points_of),
    KERNEL(any_nearer),
    KERNEL(all_hit),
    KERNEL(extent_along),
    KERNEL(out_of_view),
    KERNEL(runs_of),
    KERNEL(split_at_end_points),
    KERNEL(fitted_lines),
    KERNEL(agreed_direction),
    KERNEL(along_lane),
    KERNEL(in_lane),
    KERNEL(lane_beside),
    KERNEL(lane_in_sight),
    KERNEL(seen_in_sector),
    KERNEL(count_votes),
    KERNEL(on_walls),
    KERNEL(normal_equations),
    {NULL, NULL, 0, NULL},
};

KERNELS_OF("perception")
