/* The functions of arithmetic.py that a tick calls most. */
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

static PyMethodDef kernels[] = {
    {"cos_sin", cos_sin_kernel, METH_O, NULL},
    {"atan2", (PyCFunction)(void (*)(void))atan2_kernel, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

KERNELS_OF("transport")
