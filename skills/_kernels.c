/* The skills' hot functions: see the Python functions of the same names in surroundings.py, outline.py, safety.py, passage.py. */
#include "../transport/kernels.h"

#include <stdlib.h>

/* As in surroundings.py. */
#define STRIDE 3
#define REMEMBERED 400
/* As in safety.py. */
#define OPPOSITE 0.9
#define SHORT (2.0 / 7.0)

static int of_points(const Array *points)
{
    int good = points->rows == 0 || points->columns == 2;
    if (!good)
        PyErr_SetString(PyExc_ValueError, "points have the shape (n, 2)");
    return good;
}

/* The nearest hit of every three beams within reach, from `kept` on; how many there are. */
static Py_ssize_t nearest_hits(const Beams *beams, const double *place, double reach, double *kept)
{
    Py_ssize_t near = 0;
    for (Py_ssize_t first = 0; first + STRIDE <= beams->ranges.columns; first += STRIDE) {
        double least = INFINITY;
        Py_ssize_t nearest = first;
        for (Py_ssize_t beam = first; beam < first + STRIDE; beam++)
            if (NUMBER(beams->ranges, beam) < reach && NUMBER(beams->ranges, beam) < least) {
                least = NUMBER(beams->ranges, beam);
                nearest = beam;
            }
        if (!isfinite(least))
            continue;
        kept[2 * near] = place[0] + least * NUMBER(beams->cosines, nearest);
        kept[2 * near + 1] = place[1] + least * NUMBER(beams->sines, nearest);
        near++;
    }
    return near;
}

/* Copies the first two numbers of each kept row; the rows are counted before. */
static PyObject *pairs(const double *kept, Py_ssize_t count)
{
    Array points;
    PyObject *found = made(&points, count, 2);
    if (!found)
        return NULL;
    for (Py_ssize_t index = 0; index < count; index++) {
        ENTRY(points, index, 0) = kept[2 * index];
        ENTRY(points, index, 1) = kept[2 * index + 1];
    }
    closed(&points);
    return found;
}

static PyObject *nearest_of_beams(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Beams beams;
    double place[2], reach;
    if (!takes("nearest_of_beams", 5, count) || !of_tuple(arguments[3], 2, place) ||
        !numbers(arguments + 4, 1, &reach) || !beams_opened(arguments, &beams))
        return NULL;
    double *kept = malloc((beams.ranges.columns + 1) * 2 * sizeof(double));
    PyObject *found = kept ? pairs(kept, nearest_hits(&beams, place, reach, kept)) : PyErr_NoMemory();
    free(kept);
    beams_closed(&beams);
    return found;
}

/* Where points are for a robot that has moved, those within reach, from `kept` on; how many there are. */
static Py_ssize_t carried(const Array *points, const double *motion, double reach, double *kept)
{
    double x = motion[0], y = motion[1], cos = motion[2], sin = motion[3];
    Py_ssize_t near = 0;
    for (Py_ssize_t index = 0; index < points->rows; index++) {
        double dx = ENTRY(*points, index, 0) - x, dy = ENTRY(*points, index, 1) - y;
        double ahead = cos * dx + sin * dy, aside = cos * dy - sin * dx;
        kept[2 * near] = ahead, kept[2 * near + 1] = aside;
        near += norm(ahead, aside) < reach;
    }
    return near;
}

static PyObject *carried_near(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double motion[4], reach;
    PyObject *found = NULL;
    if (!takes("carried_near", 3, count) || !of_tuple(arguments[1], 4, motion) ||
        !numbers(arguments + 2, 1, &reach) || !opened(arguments[0], &points, "d", 0))
        return NULL;
    double *kept = malloc((points.rows + 1) * 2 * sizeof(double));
    if (!kept)
        PyErr_NoMemory();
    else if (of_points(&points))
        found = pairs(kept, carried(&points, motion, reach, kept));
    free(kept);
    closed(&points);
    return found;
}

static PyObject *seen_and_behind(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Beams beams;
    Array before;
    double view[7], motion[4], reach;
    PyObject *found = NULL, *arrays[3];
    if (!takes("seen_and_behind", 5, count) || !of_tuple(arguments[1], 7, view) ||
        !numbers(arguments + 2, 1, &reach) || !of_tuple(arguments[4], 4, motion))
        return NULL;
    if (!PyTuple_Check(arguments[0]) || PyTuple_Size(arguments[0]) != 3) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a tuple of three arrays here");
        return NULL;
    }
    for (int array = 0; array < 3; array++)
        arrays[array] = PyTuple_GetItem(arguments[0], array);
    if (!beams_opened(arrays, &beams))
        return NULL;
    if (!opened(arguments[3], &before, "d", 0)) {
        beams_closed(&beams);
        return NULL;
    }
    double *kept = malloc((beams.ranges.columns + before.rows + 1) * 2 * sizeof(double));
    if (!kept) {
        PyErr_NoMemory();
    } else if (of_points(&before)) {
        Py_ssize_t seen = nearest_hits(&beams, view, reach, kept), hidden = 0;
        double *behind = kept + 2 * seen;
        Py_ssize_t near = carried(&before, motion, reach, behind);
        for (Py_ssize_t index = 0; index < near; index++) {
            double x = behind[2 * index], y = behind[2 * index + 1];
            behind[2 * hidden] = x, behind[2 * hidden + 1] = y;
            hidden += !in_view(x, y, view);
        }
        if (hidden > REMEMBERED) {
            memmove(behind, behind + 2 * (hidden - REMEMBERED), REMEMBERED * 2 * sizeof(double));
            hidden = REMEMBERED;
        }
        found = pairs(kept, seen + hidden);
    }
    free(kept);
    closed(&before);
    beams_closed(&beams);
    return found;
}

static PyObject *turned_near(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double turn[2], reach;
    PyObject *found = NULL;
    if (!takes("turned_near", 3, count) || !of_tuple(arguments[1], 2, turn) || !numbers(arguments + 2, 1, &reach) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    double *kept = malloc((points.rows + 1) * 2 * sizeof(double));
    Py_ssize_t near = 0;
    if (!kept)
        PyErr_NoMemory();
    if (kept && of_points(&points)) {
        for (Py_ssize_t index = 0; index < points.rows; index++) {
            double x = ENTRY(points, index, 0), y = ENTRY(points, index, 1);
            kept[2 * near] = turn[0] * x + turn[1] * y, kept[2 * near + 1] = turn[0] * y - turn[1] * x;
            near += fabs(x) < reach && fabs(y) < reach;
        }
        found = pairs(kept, near);
    }
    free(kept);
    closed(&points);
    return found;
}

static inline double beyond(double offset, double core)
{
    double sign = (offset > 0.0) - (offset < 0.0);
    return sign * greater(fabs(offset) - core, 0.0);
}

/* Where a point is from the outline's core, and how far from the outline. */
static inline double outside(const double *box, double px, double py, double *x, double *y)
{
    *x = beyond(px - box[0], box[2]), *y = beyond(py - box[1], box[3]);
    return greater(norm(*x, *y) - box[4], 0.0);
}

static PyObject *from_core(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, apart, distances;
    double box[5];
    PyObject *ways = NULL, *lengths = NULL, *found = NULL;
    if (!takes("from_core", 2, count) || !of_tuple(arguments[1], 5, box) || !opened(arguments[0], &points, "d", 0))
        return NULL;
    if (!of_points(&points))
        goto points_open;
    ways = made(&apart, points.rows, 2);
    if (!ways)
        goto points_open;
    lengths = made(&distances, VECTOR, points.rows);
    if (lengths) {
        for (Py_ssize_t index = 0; index < points.rows; index++) {
            double x, y;
            NUMBER(distances, index) = outside(box, ENTRY(points, index, 0), ENTRY(points, index, 1), &x, &y);
            ENTRY(apart, index, 0) = x, ENTRY(apart, index, 1) = y;
        }
        closed(&distances);
        found = Py_BuildValue("(OO)", ways, lengths);
        Py_DECREF(lengths);
    }
    closed(&apart);
    Py_DECREF(ways);
points_open:
    closed(&points);
    return found;
}

/* The least clearance of points at some poses, three numbers each, without the rounding of the outline's corners. */
static double least_of(const Array *points, const double *poses, Py_ssize_t count, const double *box)
{
    double least = INFINITY;
    for (Py_ssize_t pose = 0; pose < count; pose++) {
        double cos, sin, x0 = poses[3 * pose], y0 = poses[3 * pose + 1];
        cos_sin(poses[3 * pose + 2], &cos, &sin);
        for (Py_ssize_t index = 0; index < points->rows; index++) {
            double dx = ENTRY(*points, index, 0) - x0, dy = ENTRY(*points, index, 1) - y0;
            double x = fabs(cos * dx + sin * dy - box[0]) - box[2];
            double y = fabs(cos * dy - sin * dx - box[1]) - box[3];
            double outside = norm(greater(x, 0.0), greater(y, 0.0));
            least = lesser(least, outside + lesser(greater(x, y), 0.0));
        }
    }
    return least;
}

static PyObject *least_clearance(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points, poses;
    double box[5], least = INFINITY;
    if (!takes("least_clearance", 3, count) || !of_tuple(arguments[2], 5, box) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    if (!opened(arguments[1], &poses, "d", 0)) {
        closed(&points);
        return NULL;
    }
    int good = of_points(&points) && poses.columns == 3;
    for (Py_ssize_t row = 0; good && row < poses.rows; row++) {
        double pose[3] = {ENTRY(poses, row, 0), ENTRY(poses, row, 1), ENTRY(poses, row, 2)};
        least = lesser(least, least_of(&points, pose, 1, box));
    }
    closed(&poses);
    closed(&points);
    if (!good) {
        if (!PyErr_Occurred())
            PyErr_SetString(PyExc_ValueError, "poses have the shape (k, 3)");
        return NULL;
    }
    return PyFloat_FromDouble(least - box[4]);
}

/* The poses after a period and after each period of braking, `total` of three numbers each; NULL with an exception set. */
static double *stopped(PyObject *const *arguments, Py_ssize_t *total_of)
{
    double given[3], period, changes[2], x = 0.0, y = 0.0, heading = 0.0;
    Py_ssize_t total = 0, room = 64;
    if (!of_tuple(arguments[0], 3, given) || !numbers(arguments + 1, 1, &period) || !of_tuple(arguments[2], 2, changes))
        return NULL;
    if (!isfinite(given[0] + given[1] + given[2]) || !(changes[0] > 0.0 && changes[1] > 0.0)) {
        PyErr_SetString(PyExc_ValueError, "a velocity is finite, and braking changes it");
        return NULL;
    }
    Velocity velocity = {given[0], given[1], given[2]}, rest = {0.0, 0.0, 0.0};
    double *poses = malloc(room * 3 * sizeof(double));
    while (poses && (velocity.forward != 0.0 || velocity.left != 0.0 || velocity.turn != 0.0)) {
        double cos, sin, half = velocity.turn * period / 2, chord = period * chord_over_arc(half);
        cos_sin(heading + half, &cos, &sin);
        cos = chord * cos, sin = chord * sin;
        x = x + cos * velocity.forward - sin * velocity.left;
        y = y + sin * velocity.forward + cos * velocity.left;
        heading = remainder(heading + velocity.turn * period, 2.0 * 3.141592653589793);
        if (total == room) {
            double *more = realloc(poses, (room *= 2) * 3 * sizeof(double));
            if (!more)
                free(poses);
            poses = more;
            if (!poses)
                break;
        }
        poses[3 * total] = x, poses[3 * total + 1] = y, poses[3 * total + 2] = heading;
        total++;
        reached(&velocity, rest, changes);
    }
    if (!poses) {
        PyErr_NoMemory();
        return NULL;
    }
    if (!total)
        poses[0] = poses[1] = poses[2] = 0.0, total = 1;
    *total_of = total;
    return poses;
}

static PyObject *stopping(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Py_ssize_t total;
    Array array;
    double *poses = takes("stopping", 3, count) ? stopped(arguments, &total) : NULL;
    if (!poses)
        return NULL;
    PyObject *found = made(&array, total, 3);
    if (found) {
        for (Py_ssize_t pose = 0; pose < total; pose++)
            for (int part = 0; part < 3; part++)
                ENTRY(array, pose, part) = poses[3 * pose + part];
        closed(&array);
    }
    free(poses);
    return found;
}

static PyObject *clearance_in_stopping(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double box[5], least = INFINITY;
    Py_ssize_t total;
    if (!takes("clearance_in_stopping", 5, count) || !of_tuple(arguments[1], 5, box))
        return NULL;
    double *poses = stopped(arguments + 2, &total);
    if (!poses)
        return NULL;
    int good = opened(arguments[0], &points, "d", 0);
    if (good) {
        good = of_points(&points);
        if (good)
            least = least_of(&points, poses, total, box);
        closed(&points);
    }
    free(poses);
    return good ? PyFloat_FromDouble(least - box[4]) : NULL;
}

/* From what is at the left to what is at the right; `bounds` are rear, front, side and foresee. */
static double room_between(const Array *points, const double *bounds)
{
    double faced = INFINITY, left = INFINITY, right = -INFINITY;
    double rear = bounds[0], front = bounds[1], side = bounds[2], foresee = bounds[3];
    for (Py_ssize_t index = 0; index < points->rows; index++) {
        double x = ENTRY(*points, index, 0);
        if (fabs(ENTRY(*points, index, 1)) < side && x > front)
            faced = lesser(faced, x);
    }
    double ahead = isinf(faced) ? foresee : lesser(foresee, faced - SHORT * foresee);
    for (Py_ssize_t index = 0; index < points->rows; index++) {
        double x = ENTRY(*points, index, 0), y = ENTRY(*points, index, 1);
        if (!(x > rear && x < ahead))
            continue;
        if (y > 0.0)
            left = lesser(left, y);
        if (y < 0.0)
            right = greater(right, y);
    }
    return isinf(left) || isinf(right) ? INFINITY : left - right;
}

static PyObject *room_ahead(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double bounds[4], room = INFINITY;
    if (!takes("room_ahead", 2, count) || !of_tuple(arguments[1], 4, bounds) || !opened(arguments[0], &points, "d", 0))
        return NULL;
    int good = of_points(&points);
    if (good)
        room = room_between(&points, bounds);
    closed(&points);
    return good ? PyFloat_FromDouble(room) : NULL;
}

/* Whether a point is opposite to another one in a direction. */
static inline int opposite(double x, double y, double towards_x, double towards_y)
{
    return x * towards_x + y * towards_y < -OPPOSITE * norm(x, y);
}

static PyObject *looked_round(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double box[5], bounds[4], across = INFINITY, now = INFINITY, x, y, ahead = INFINITY;
    if (!takes("looked_round", 3, count) || !of_tuple(arguments[1], 5, box) || !of_tuple(arguments[2], 4, bounds) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    int good = of_points(&points) && points.rows;
    if (!good && !PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "there is a point at least");
    if (good) {
        Py_ssize_t nearest = 0;
        for (Py_ssize_t index = 0; index < points.rows; index++) {
            double distance = outside(box, ENTRY(points, index, 0), ENTRY(points, index, 1), &x, &y);
            if (index == 0 || distance < now)
                now = distance, nearest = index;
        }
        outside(box, ENTRY(points, nearest, 0), ENTRY(points, nearest, 1), &x, &y);
        double length = greater(norm(x, y), 1e-9), towards_x = x / length, towards_y = y / length;
        for (Py_ssize_t index = 0; index < points.rows; index++) {
            double distance = outside(box, ENTRY(points, index, 0), ENTRY(points, index, 1), &x, &y);
            if (opposite(x, y, towards_x, towards_y))
                across = lesser(across, distance);
        }
        ahead = room_between(&points, bounds);
    }
    closed(&points);
    return good ? Py_BuildValue("(ddd)", now, ahead, now + across) : NULL;
}

static PyObject *room_across(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array apart, distances;
    double least = INFINITY;
    if (!takes("room_across", 3, count))
        return NULL;
    Py_ssize_t nearest = PyLong_AsSsize_t(arguments[2]);
    if (PyErr_Occurred() || !opened(arguments[0], &apart, "d", 0))
        return NULL;
    if (!opened(arguments[1], &distances, "d", 0)) {
        closed(&apart);
        return NULL;
    }
    int good = of_points(&apart) && apart.rows == distances.columns && nearest >= 0 && nearest < apart.rows;
    if (good) {
        double x = ENTRY(apart, nearest, 0), y = ENTRY(apart, nearest, 1), length = greater(norm(x, y), 1e-9);
        x /= length, y /= length;
        for (Py_ssize_t index = 0; index < apart.rows; index++) {
            if (opposite(ENTRY(apart, index, 0), ENTRY(apart, index, 1), x, y))
                least = lesser(least, NUMBER(distances, index));
        }
        least = NUMBER(distances, nearest) + least;
    } else if (!PyErr_Occurred()) {
        PyErr_SetString(PyExc_ValueError, "there is one distance for each point, and one of them is the nearest");
    }
    closed(&distances);
    closed(&apart);
    return good ? PyFloat_FromDouble(least) : NULL;
}

static int by_size(const void *one, const void *other)
{
    double first = *(const double *)one, second = *(const double *)other;
    return (first > second) - (first < second);
}

/* The gap of at least `width` between sorted values within two bounds that is nearest to zero; 0 if there is none. */
static int nearest_gap(const double *sorted, Py_ssize_t count, const double *within, double width, double aside,
                       double *gap)
{
    double least = INFINITY, low = within[0];
    int found = 0;
    for (Py_ssize_t index = 0; index <= count; index++) {
        double high = index < count ? sorted[index] : within[1];
        if (index < count && !(high > within[0] && high < within[1]))
            continue;
        if (high - low >= width) {
            double distance = greater(greater(low, -high), 0.0);
            if (!found || distance < least)
                least = distance, gap[0] = low, gap[1] = high;
            found = 1;
        }
        low = high;
    }
    return found && !(least > aside);
}

static PyObject *passage_between(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array points;
    double given[5], ahead = INFINITY;
    if (!takes("passage_between", 2, count) || !of_tuple(arguments[1], 5, given) ||
        !opened(arguments[0], &points, "d", 0))
        return NULL;
    double half = given[0], look_ahead = given[1], alongside = given[2], aside = given[3], width = given[4];
    double around[2] = {-INFINITY, INFINITY}, gap[2] = {-INFINITY, INFINITY};
    double *values = malloc((points.rows + 1) * sizeof(double));
    int good = values && of_points(&points);
    if (!values)
        PyErr_NoMemory();
    for (Py_ssize_t index = 0; good && index < points.rows; index++) {
        double x = ENTRY(points, index, 0);
        if (fabs(ENTRY(points, index, 1)) < half && x > 0.0)
            ahead = lesser(ahead, x);
    }
    double limits[2] = {lesser(greater(ahead - alongside, 0.0), look_ahead), look_ahead};
    for (int pass = 0; good && pass < 2; pass++) {
        Py_ssize_t kept = 0;
        for (Py_ssize_t index = 0; index < points.rows; index++) {
            double x = ENTRY(points, index, 0);
            values[kept] = ENTRY(points, index, 1);
            kept += x > -half && x < limits[pass];
        }
        qsort(values, kept, sizeof(double), by_size);
        double found[2], whole[2] = {-INFINITY, INFINITY};
        if (nearest_gap(values, kept, pass ? around : whole, pass ? width : 0.0, aside, found))
            memcpy(pass ? gap : around, found, sizeof(found));
        else if (pass)
            memcpy(gap, around, sizeof(gap));
    }
    free(values);
    closed(&points);
    return good ? Py_BuildValue("(ddd)", ahead, gap[0], gap[1]) : NULL;
}

static PyMethodDef kernels[] = {
    KERNEL(nearest_of_beams),
    KERNEL(carried_near),
    KERNEL(seen_and_behind),
    KERNEL(turned_near),
    KERNEL(from_core),
    KERNEL(least_clearance),
    KERNEL(stopping),
    KERNEL(clearance_in_stopping),
    KERNEL(looked_round),
    KERNEL(room_ahead),
    KERNEL(room_across),
    KERNEL(passage_between),
    {NULL, NULL, 0, NULL},
};

KERNELS_OF("skills")
