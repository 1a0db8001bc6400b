/* The simulator's hot functions: see the Python functions of the same names in lidar.py, noise.py, geometry.py, body.py. */
#include "../transport/kernels.h"

#include <stdlib.h>

#define CLOSE 1e-3
#define STRAIGHT 2e-3
/* Upper limit of the error of `rough_angle`, rad, well below STRAIGHT; it only widens the intervals of beams. */
#define ANGLE_ERROR 3e-4
#define PI 3.141592653589793
#define TAU 6.283185307179586

/* The direction of (x, y): a minimax polynomial of the arc tangent on [0, 1] in odd powers up to seven, and symmetry. */
static inline double rough_angle(double y, double x)
{
    double larger = greater(fabs(x), fabs(y)), smaller = lesser(fabs(x), fabs(y));
    if (larger == 0.0)
        return 0.0;
    double ratio = smaller / larger;
    double square = ratio * ratio;
    double angle = ((-0.0464964749 * square + 0.15931422) * square - 0.327622764) * square * ratio + ratio;
    if (fabs(y) > fabs(x))
        angle = PI / 2 - angle;
    if (x < 0.0)
        angle = PI - angle;
    return y < 0.0 ? -angle : angle;
}

static inline double along_beam(double ux, double uy, double ax, double ay, double bx, double by)
{
    double side_a = ux * ay - uy * ax, side_b = ux * by - uy * bx;
    double ahead_a = ux * ax + uy * ay, ahead_b = ux * bx + uy * by;
    if (side_a == side_b)
        return lesser(ahead_a >= 0.0 ? ahead_a : INFINITY, ahead_b >= 0.0 ? ahead_b : INFINITY);
    double distance = ahead_a + side_a / (side_a - side_b) * (ahead_b - ahead_a);
    return distance >= 0.0 ? distance : INFINITY;
}

typedef struct {
    double ax, ay, bx, by;
} Wall;

/* The beams from `begin` up to `end` against a wall whose line passes close to the sensor. */
static void meet_close(const Wall *wall, const double *beam_x, const double *beam_y, Py_ssize_t begin, Py_ssize_t end,
                       double *nearest)
{
    for (Py_ssize_t beam = begin; beam < end; beam++) {
        double ux = beam_x[beam], uy = beam_y[beam];
        double side_a = ux * wall->ay - uy * wall->ax, side_b = ux * wall->by - uy * wall->bx;
        if (lesser(side_a, side_b) <= 0.0 && greater(side_a, side_b) >= 0.0)
            nearest[beam] = lesser(nearest[beam], along_beam(ux, uy, wall->ax, wall->ay, wall->bx, wall->by));
    }
}

/* The same for any other wall: the largest reciprocal of the distance. */
static void meet(const Wall *wall, double px, double py, const double *restrict beam_x, const double *restrict beam_y,
                 Py_ssize_t begin, Py_ssize_t end, double *restrict nearness)
{
    double ax = wall->ax, ay = wall->ay, bx = wall->bx, by = wall->by;
    for (Py_ssize_t beam = begin; beam < end; beam++) {
        double ux = beam_x[beam], uy = beam_y[beam];
        double side_a = ux * ay - uy * ax, side_b = ux * by - uy * bx;
        double inverse = ux * px + uy * py, best = nearness[beam];
        int crossed = ((side_a <= 0.0) & (side_b >= 0.0)) | ((side_a >= 0.0) & (side_b <= 0.0));
        nearness[beam] = crossed & (inverse > best) ? inverse : best;
    }
}

static void project_walls(const Array *segments, const double *sensor, const Array *beams, const double *fan,
                          double *nearness, double *nearest)
{
    double x = sensor[0], y = sensor[1], cos = sensor[2], sin = sensor[3];
    double angle_min = fan[0], increment = fan[1], last = beams->columns - 1.0;
    double widening = ANGLE_ERROR / increment + 1.0;
    const double *beam_x = &ENTRY(*beams, 0, 0), *beam_y = &ENTRY(*beams, 1, 0);
    for (Py_ssize_t index = 0; index < segments->rows; index++) {
        double dx = ENTRY(*segments, index, 0) - x, dy = ENTRY(*segments, index, 1) - y;
        Wall wall = {cos * dx + sin * dy, cos * dy - sin * dx, 0.0, 0.0};
        dx = ENTRY(*segments, index, 2) - x, dy = ENTRY(*segments, index, 3) - y;
        wall.bx = cos * dx + sin * dy, wall.by = cos * dy - sin * dx;
        double first = rough_angle(wall.ay, wall.ax), second = rough_angle(wall.by, wall.bx);
        double low = lesser(first, second), high = greater(first, second);
        double wx = wall.bx - wall.ax, wy = wall.by - wall.ay;
        double area = wall.ax * wall.by - wall.ay * wall.bx;
        int close = area * area < CLOSE * CLOSE * (wx * wx + wy * wy);
        if (fabs(high - low - PI) < STRAIGHT) {
            low = -PI, high = PI;
        } else if (high - low > PI) {
            double over = low + TAU;
            low = high, high = over;
        }
        for (int turn = -1; turn <= 1; turn++) {
            double start = (low + turn * TAU - angle_min) / increment - widening;
            double stop = (high + turn * TAU - angle_min) / increment + widening;
            if (stop < 0.0 || start > last)
                continue;
            Py_ssize_t begin = (Py_ssize_t)greater(start, 0.0), end = (Py_ssize_t)lesser(stop, last) + 1;
            if (close)
                meet_close(&wall, beam_x, beam_y, begin, end, nearest);
            else
                meet(&wall, wy / area, -wx / area, beam_x, beam_y, begin, end, nearness);
        }
    }
}

static PyObject *project(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double sensor[4], fan[3];
    Array segments, beams, ranges, nearest;
    PyObject *found = NULL, *close = NULL;
    if (!takes("project", 4, count) || !of_tuple(arguments[1], 4, sensor) || !of_tuple(arguments[3], 3, fan) ||
        !opened(arguments[0], &segments, "d", 0))
        return NULL;
    if (!opened(arguments[2], &beams, "d", 0))
        goto segments_open;
    if (beams.rows != 2 || beams.column_step != sizeof(double) || (segments.rows && segments.columns != 4)) {
        PyErr_SetString(PyExc_ValueError, "segments have the shape (n, 4), beams (2, n) row by row");
        goto beams_open;
    }
    close = made(&nearest, VECTOR, beams.columns);
    if (!close)
        goto beams_open;
    found = made(&ranges, VECTOR, beams.columns);
    if (found) {
        double *nearness = (double *)ranges.data, *nearest_close = (double *)nearest.data;
        for (Py_ssize_t beam = 0; beam < beams.columns; beam++)
            nearness[beam] = 0.0, nearest_close[beam] = INFINITY;
        project_walls(&segments, sensor, &beams, fan, nearness, nearest_close);
        for (Py_ssize_t beam = 0; beam < beams.columns; beam++) {
            double distance = lesser(1.0 / nearness[beam], nearest_close[beam]);
            nearness[beam] = distance <= fan[2] ? distance : INFINITY;
        }
        closed(&ranges);
    }
    closed(&nearest);
    Py_DECREF(close);
beams_open:
    closed(&beams);
segments_open:
    closed(&segments);
    return found;
}

static PyObject *disturb(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array exact, draws;
    double by[2];
    if (!takes("disturb", 4, count) || !numbers(arguments + 2, 2, by) ||
        !opened(arguments[0], &exact, "d", PyBUF_WRITABLE))
        return NULL;
    if (!opened(arguments[1], &draws, "d", 0)) {
        closed(&exact);
        return NULL;
    }
    double size = by[0], furthest = by[1], width = 2.0 * size;
    Py_ssize_t beams = lesser(exact.columns, draws.columns);
    for (Py_ssize_t beam = 0; beam < beams; beam++) {
        double reading = NUMBER(exact, beam) + (NUMBER(draws, beam) * width - size);
        reading = reading < 0.0 ? 0.0 : reading;
        NUMBER(exact, beam) = reading > furthest ? INFINITY : reading;
    }
    closed(&draws);
    closed(&exact);
    Py_RETURN_NONE;
}

/* The square of a point's distance from a segment. */
static inline double square_from(double px, double py, double ax, double ay, double bx, double by)
{
    double dx = bx - ax, dy = by - ay;
    px -= ax, py -= ay;
    double along = lesser(greater((px * dx + py * dy) / greater(dx * dx + dy * dy, 1e-300), 0.0), 1.0);
    double x = px - along * dx, y = py - along * dy;
    return x * x + y * y;
}

static PyObject *nearest_segment(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array segments;
    double place[2], least = INFINITY;
    if (!takes("nearest_segment", 3, count) || !numbers(arguments, 2, place) ||
        !opened(arguments[2], &segments, "d", 0))
        return NULL;
    for (Py_ssize_t index = 0; index < segments.rows; index++)
        least = lesser(least, square_from(place[0], place[1], ENTRY(segments, index, 0), ENTRY(segments, index, 1),
                                          ENTRY(segments, index, 2), ENTRY(segments, index, 3)));
    closed(&segments);
    return PyFloat_FromDouble(sqrt(least));
}

/* The square of the distance between a polygon's outline and one segment that does not cross it. */
static double square_between(const Array *corners, double ax, double ay, double bx, double by)
{
    double least = INFINITY;
    for (Py_ssize_t corner = 0; corner < corners->rows; corner++) {
        Py_ssize_t next = corner + 1 < corners->rows ? corner + 1 : 0;
        double x = ENTRY(*corners, corner, 0), y = ENTRY(*corners, corner, 1);
        double next_x = ENTRY(*corners, next, 0), next_y = ENTRY(*corners, next, 1);
        least = lesser(least, square_from(x, y, ax, ay, bx, by));
        least = lesser(least, square_from(ax, ay, x, y, next_x, next_y));
        least = lesser(least, square_from(bx, by, x, y, next_x, next_y));
    }
    return least;
}

static PyObject *outline_distance(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array corners, segments;
    double least = INFINITY;
    if (!takes("outline_distance", 2, count) || !opened(arguments[0], &corners, "d", 0))
        return NULL;
    if (!opened(arguments[1], &segments, "d", 0)) {
        closed(&corners);
        return NULL;
    }
    for (Py_ssize_t index = 0; index < segments.rows; index++)
        least = lesser(least, square_between(&corners, ENTRY(segments, index, 0), ENTRY(segments, index, 1),
                                             ENTRY(segments, index, 2), ENTRY(segments, index, 3)));
    closed(&segments);
    closed(&corners);
    return PyFloat_FromDouble(sqrt(least));
}

static PyObject *outline_near(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array outline, segments;
    double pose[4], reach, least = INFINITY;
    if (!takes("outline_near", 4, count) || !of_tuple(arguments[1], 4, pose) || !numbers(arguments + 3, 1, &reach) ||
        !opened(arguments[0], &outline, "d", 0))
        return NULL;
    if (!opened(arguments[2], &segments, "d", 0)) {
        closed(&outline);
        return NULL;
    }
    double x = pose[0], y = pose[1], cos = pose[2], sin = pose[3];
    double *corners = malloc((outline.rows + 1) * 2 * sizeof(double));
    int good = corners && outline.columns == 2 && (!segments.rows || segments.columns == 4);
    if (!corners)
        PyErr_NoMemory();
    else if (!good)
        PyErr_SetString(PyExc_ValueError, "corners have the shape (n, 2), segments (n, 4)");
    for (Py_ssize_t corner = 0; good && corner < outline.rows; corner++) {
        double ahead = ENTRY(outline, corner, 0), aside = ENTRY(outline, corner, 1);
        corners[2 * corner] = x + cos * ahead - sin * aside;
        corners[2 * corner + 1] = y + sin * ahead + cos * aside;
    }
    Array placed = {.data = (char *)corners, .rows = outline.rows, .columns = 2, .row_step = 2 * sizeof(double),
                    .column_step = sizeof(double)};
    for (Py_ssize_t index = 0; good && index < segments.rows; index++) {
        double ax = ENTRY(segments, index, 0), ay = ENTRY(segments, index, 1);
        double bx = ENTRY(segments, index, 2), by = ENTRY(segments, index, 3);
        if (sqrt(square_from(x, y, ax, ay, bx, by)) <= reach)
            least = lesser(least, square_between(&placed, ax, ay, bx, by));
    }
    free(corners);
    closed(&segments);
    closed(&outline);
    return good ? PyFloat_FromDouble(sqrt(least)) : NULL;
}

/* Some steps along an arc: x, y and heading in `place`. */
static void followed(double *place, Velocity velocity, double duration, long steps)
{
    double cos, sin, half = velocity.turn * duration / 2;
    double chord = chord_over_arc(half);
    for (long step = 0; step < steps; step++) {
        cos_sin(place[2] + half, &cos, &sin);
        cos = chord * cos, sin = chord * sin;
        place[0] += (cos * velocity.forward - sin * velocity.left) * duration;
        place[1] += (sin * velocity.forward + cos * velocity.left) * duration;
        place[2] += velocity.turn * duration;
    }
}

static PyObject *glided(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double place[3], before[3], after[3], changes[2], duration;
    if (!takes("glided", 5, count) || !of_tuple(arguments[0], 3, place) || !of_tuple(arguments[2], 2, changes) ||
        !numbers(arguments + 3, 1, &duration))
        return NULL;
    if (!PyTuple_Check(arguments[1]) || PyTuple_Size(arguments[1]) != 2) {
        PyErr_SetString(PyExc_TypeError, "a kernel takes a tuple of two velocities here");
        return NULL;
    }
    if (!of_tuple(PyTuple_GetItem(arguments[1], 0), 3, before) || !of_tuple(PyTuple_GetItem(arguments[1], 1), 3, after))
        return NULL;
    long steps = PyLong_AsLong(arguments[4]);
    if (steps == -1 && PyErr_Occurred())
        return NULL;
    Velocity velocity = {before[0], before[1], before[2]}, wanted = {after[0], after[1], after[2]};
    int arrived = 0;
    while (steps > 0) {
        arrived = reached(&velocity, wanted, changes);
        followed(place, velocity, duration, arrived ? steps : 1);
        steps = arrived ? 0 : steps - 1;
    }
    return Py_BuildValue("(ddd)(ddd)O", place[0], place[1], place[2], velocity.forward, velocity.left, velocity.turn,
                         arrived ? Py_True : Py_False);
}

static PyObject *follow_arc(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double place[3], velocity[3], duration;
    if (!takes("follow_arc", 4, count) || !of_tuple(arguments[0], 3, place) || !of_tuple(arguments[1], 3, velocity) ||
        !numbers(arguments + 2, 1, &duration))
        return NULL;
    long steps = PyLong_AsLong(arguments[3]);
    if (steps == -1 && PyErr_Occurred())
        return NULL;
    followed(place, (Velocity){velocity[0], velocity[1], velocity[2]}, duration, steps);
    return Py_BuildValue("(ddd)", place[0], place[1], place[2]);
}

static PyMethodDef kernels[] = {
    KERNEL(project),
    KERNEL(disturb),
    KERNEL(nearest_segment),
    KERNEL(outline_distance),
    KERNEL(outline_near),
    KERNEL(glided),
    KERNEL(follow_arc),
    {NULL, NULL, 0, NULL},
};

KERNELS_OF("sim")
