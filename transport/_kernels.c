/* The functions of arithmetic.py that a tick calls most, and the count of sanity.py. */
#include "kernels.h"

static PyObject *cos_sin_of(double angle)
{
    double cosine, sine;
    if (isinf(angle)) {
        PyErr_SetString(PyExc_ValueError, "the sine of an infinite angle");
        return NULL;
    }
    if (isnan(angle))
        return Py_BuildValue("(dd)", angle, angle);
    cos_sin(angle, &cosine, &sine);
    return Py_BuildValue("(dd)", cosine, sine);
}

static PyObject *cos_sin_kernel(PyObject *Py_UNUSED(module), PyObject *argument)
{
    double angle = PyFloat_AsDouble(argument);
    return angle == -1.0 && PyErr_Occurred() ? NULL : cos_sin_of(angle);
}

static PyObject *atan2_kernel(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    double given[2];
    if (!takes("atan2", 2, count) || !numbers(arguments, 2, given))
        return NULL;
    return PyFloat_FromDouble(direction(given[0], given[1]));
}

static PyObject *counted(PyObject *Py_UNUSED(module), PyObject *const *arguments, Py_ssize_t count)
{
    Array ranges;
    double given;
    Py_ssize_t seeing = 0, too_near = 0;
    int negative = 0;
    if (!takes("counted", 2, count) || !numbers(arguments + 1, 1, &given) || !opened(arguments[0], &ranges, "f", 0))
        return NULL;
    float shortest = (float)given;
    for (Py_ssize_t beam = 0; beam < ranges.columns; beam++) {
        float range = *(float *)(ranges.data + beam * ranges.column_step);
        seeing += range >= shortest;
        too_near += range == -INFINITY;
        negative |= range < 0.0f && isfinite(range);
    }
    closed(&ranges);
    return Py_BuildValue("(nnO)", seeing, too_near, negative ? Py_True : Py_False);
}

static PyMethodDef kernels[] = {
    {"cos_sin", cos_sin_kernel, METH_O, NULL},
    {"atan2", (PyCFunction)(void (*)(void))atan2_kernel, METH_FASTCALL, NULL},
    KERNEL(counted),
    {NULL, NULL, 0, NULL},
};

KERNELS_OF("transport")
