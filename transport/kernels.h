/* What the compiled kernels of all packages share: arrays by the buffer protocol, and transport/arithmetic.py in C.
 *
 * A kernel is a function of the Python module beside it, written a second time. It gives the same bits: the same
 * operations on the same numbers in the same order. So nothing here calls a function of the C library that rounds, and
 * the compiler may neither contract (-ffp-contract=off) nor reorder. Only the stable ABI of Python is used, and numpy only
 * from the Python side: one wheel serves all versions of both.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <string.h>

/* An array of one or two dimensions, of any strides; of one dimension, it has one row. */
typedef struct {
    Py_buffer view;
    char *data;
    Py_ssize_t rows, columns, row_step, column_step;
} Array;

#define NUMBER(array, column) (*(double *)((array).data + (column) * (array).column_step))
#define ENTRY(array, row, column) \
    (*(double *)((array).data + (row) * (array).row_step + (column) * (array).column_step))

static int opened(PyObject *object, Array *array, const char *format, int flags)
{
    if (PyObject_GetBuffer(object, &array->view, flags | PyBUF_STRIDES | PyBUF_FORMAT) < 0)
        return 0;
    const Py_buffer *view = &array->view;
    const char *found = view->format ? view->format : "B";
    if (strcmp(found, format) != 0 || view->ndim < 1 || view->ndim > 2) {
        PyErr_Format(PyExc_TypeError, "a kernel takes arrays of one or two dimensions of type %s, not %d of %s", format,
                     view->ndim, found);
        PyBuffer_Release(&array->view);
        return 0;
    }
    int last = view->ndim - 1;
    array->data = view->buf;
    array->rows = last ? view->shape[0] : 1;
    array->row_step = last ? view->strides[0] : 0;
    array->columns = view->shape[last];
    array->column_step = view->strides[last];
    return 1;
}

static void closed(Array *array)
{
    PyBuffer_Release(&array->view);
}

/* Ranges, and the direction of each as its cosine and its sine. */
typedef struct {
    Array ranges, cosines, sines;
} Beams;

static inline void beams_closed(Beams *beams)
{
    closed(&beams->sines);
    closed(&beams->cosines);
    closed(&beams->ranges);
}

/* From the first three of a kernel's arguments; 0 with an exception set. */
static inline int beams_opened(PyObject *const *arguments, Beams *beams)
{
    if (!opened(arguments[0], &beams->ranges, "d", 0))
        return 0;
    if (!opened(arguments[1], &beams->cosines, "d", 0))
        goto ranges_open;
    if (!opened(arguments[2], &beams->sines, "d", 0))
        goto cosines_open;
    if (beams->cosines.columns == beams->ranges.columns && beams->sines.columns == beams->ranges.columns)
        return 1;
    PyErr_SetString(PyExc_ValueError, "there is one direction for each range");
    closed(&beams->sines);
cosines_open:
    closed(&beams->cosines);
ranges_open:
    closed(&beams->ranges);
    return 0;
}

/* In place of a number of rows: an array of one dimension. */
#define VECTOR -1

/* A new array of numpy's, opened for writing; NULL with an exception set. */
static inline PyObject *made(Array *array, Py_ssize_t rows, Py_ssize_t columns)
{
    static PyObject *empty; /* numpy.empty; numpy is imported for the first array, not to tell the version */
    if (!empty) {
        PyObject *numpy = PyImport_ImportModule("numpy");
        empty = numpy ? PyObject_GetAttrString(numpy, "empty") : NULL;
        Py_XDECREF(numpy);
        if (!empty)
            return NULL;
    }
    PyObject *object = rows >= 0 ? PyObject_CallFunction(empty, "((nn))", rows, columns)
                            : PyObject_CallFunction(empty, "(n)", columns);
    if (object && !opened(object, array, "d", PyBUF_WRITABLE)) {
        Py_DECREF(object);
        return NULL;
    }
    return object;
}

/* Numbers of a tuple or of a kernel's arguments; 0 with an exception set. */
static int numbers(PyObject *const *arguments, Py_ssize_t count, double *found)
{
    for (Py_ssize_t index = 0; index < count; index++) {
        found[index] = PyFloat_AsDouble(arguments[index]);
        if (found[index] == -1.0 && PyErr_Occurred())
            return 0;
    }
    return 1;
}

static inline int of_tuple(PyObject *tuple, Py_ssize_t count, double *found)
{
    if (!PyTuple_Check(tuple) || PyTuple_Size(tuple) != count) {
        PyErr_Format(PyExc_TypeError, "a kernel takes a tuple of %zd numbers here", count);
        return 0;
    }
    for (Py_ssize_t index = 0; index < count; index++) {
        PyObject *entry = PyTuple_GetItem(tuple, index);
        if (!numbers(&entry, 1, found + index))
            return 0;
    }
    return 1;
}

static int takes(const char *kernel, Py_ssize_t wanted, Py_ssize_t given)
{
    if (wanted != given)
        PyErr_Format(PyExc_TypeError, "%s takes %zd arguments, not %zd", kernel, wanted, given);
    return wanted == given;
}

/* Whole numbers of numpy's index type. */
#define INDEX(array, place) ((Py_ssize_t) * (int64_t *)((array).data + (place) * (array).column_step))

static inline int opened_indices(PyObject *object, Array *array)
{
    return opened(object, array, sizeof(long) == 8 ? "l" : "q", 0);
}

#define KERNEL(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL}
#define KERNELS_OF(package) \
    static struct PyModuleDef definition = { \
        PyModuleDef_HEAD_INIT, package "._kernels", NULL, -1, kernels, NULL, NULL, NULL, NULL, \
    }; \
    PyMODINIT_FUNC PyInit__kernels(void) \
    { \
        return PyModule_Create(&definition); \
    }

static inline double lesser(double one, double other)
{
    return other < one ? other : one;
}

static inline double greater(double one, double other)
{
    return other > one ? other : one;
}

static inline double norm(double x, double y)
{
    return sqrt(x * x + y * y);
}

static inline void near_zero(double near, double below, double *cosine, double *sine)
{
    double x = near - below;
    double rest = (near - x) - below;
    double z = x * x;
    double v = z * x;
    double half = 0.5 * z;
    double about = 1.0 - half;
    double tail = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    *cosine = about + (((1.0 - about) - half) + (z * tail - x * rest));
    tail = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    *sine = x - ((z * (0.5 * rest - v * tail) - rest) - v * -1.66666666666666324348e-01);
}

/* `cos_sin` of transport/arithmetic.py, for finite angles. */
static inline void cos_sin(double angle, double *cosine, double *sine)
{
    const double pi = 3.141592653589793;
    if (!(-1e5 < angle && angle < 1e5))
        angle = fmod(angle, 2.0 * pi);
    double quarters = floor(angle * (2.0 / pi) + 0.5), c, s;
    near_zero(angle - quarters * 1.57079632673412561417e00, quarters * 6.07710050650619224932e-11, &c, &s);
    switch ((int)quarters & 3) {
    case 0: *cosine = c; *sine = s; break;
    case 1: *cosine = -s; *sine = c; break;
    case 2: *cosine = -c; *sine = -s; break;
    default: *cosine = s; *sine = -c;
    }
}

/* `chord_over_arc` of transport/arithmetic.py. */
static inline double chord_over_arc(double half)
{
    double cosine, sine;
    if (fabs(half) < 1e-9)
        return 1.0;
    cos_sin(half, &cosine, &sine);
    return sine / half;
}

static inline double arc_tangent(double x)
{
    double at = 0.0, rest = 0.0;
    if (x >= 0.4375) {
        if (x < 0.6875) {
            x = (2.0 * x - 1.0) / (2.0 + x);
            at = 4.63647609000806093515e-01, rest = 2.26987774529616870924e-17;
        } else if (x < 1.1875) {
            x = (x - 1.0) / (x + 1.0);
            at = 7.85398163397448278999e-01, rest = 3.06161699786838301793e-17;
        } else if (x < 2.4375) {
            x = (x - 1.5) / (1.0 + 1.5 * x);
            at = 9.82793723247329054082e-01, rest = 1.39033110312309984516e-17;
        } else {
            x = -1.0 / x;
            at = 1.57079632679489655800e00, rest = 6.12323399573676603587e-17;
        }
    }
    double z = x * x;
    double w = z * z;
    double odd = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02
        + w * (6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
    double even = w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02
        + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
    return at - ((x * (odd + even) - rest) - x);
}

/* `atan2` of transport/arithmetic.py. */
static inline double direction(double y, double x)
{
    const double pi = 3.141592653589793;
    double along = fabs(x), across = fabs(y), angle;
    if (isnan(x) || isnan(y))
        return NAN;
    if (across == 0.0)
        angle = 0.0;
    else if (along == 0.0 || across > along * 1e18)
        angle = pi / 2;
    else if (across == along)
        angle = pi / 4;
    else
        angle = arc_tangent(across / along);
    if (signbit(x))
        angle = (6.12323399573676603587e-17 * 2 - angle) + pi;
    return copysign(angle, y);
}

/* `halfway` of transport/arithmetic.py. */
static inline void halfway(double x, double y, double *cosine, double *sine)
{
    double length = norm(x, y);
    if (length == 0.0) {
        *cosine = 1.0, *sine = 0.0;
    } else if (x >= 0) {
        *cosine = sqrt((length + x) / (2.0 * length));
        *sine = y / (2.0 * length * *cosine);
    } else {
        *sine = copysign(sqrt((length - x) / (2.0 * length)), y);
        *cosine = y / (2.0 * length * *sine);
    }
}

/* Whether a sensor looks at a place, whatever is in between; its view has the order of `FieldOfView`. */
static inline int in_view(double x, double y, const double *view)
{
    x -= view[0], y -= view[1];
    int after_first = view[2] * y - view[3] * x >= -1e-5, before_last = view[5] * x - view[4] * y >= -1e-5;
    return view[6] > 3.141592653589793 ? after_first || before_last : after_first && before_last;
}

typedef struct {
    double forward, left, turn;
} Velocity;

/* `reached` of transport/base.py; whether the wanted velocity is reached. */
static inline int reached(Velocity *velocity, Velocity wanted, const double *changes)
{
    double forward = wanted.forward - velocity->forward, left = wanted.left - velocity->left;
    double turn = wanted.turn - velocity->turn, change = norm(forward, left);
    int far = change > changes[0], far_turn = fabs(turn) > changes[1];
    double share = changes[0] / change;
    velocity->forward = far ? velocity->forward + share * forward : wanted.forward;
    velocity->left = far ? velocity->left + share * left : wanted.left;
    velocity->turn = far_turn ? velocity->turn + copysign(changes[1], turn) : wanted.turn;
    return !far && !far_turn;
}
