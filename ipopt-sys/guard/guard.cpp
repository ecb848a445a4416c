// An exception that leaves C++ through a C interface into Rust is undefined
// behaviour. These wrappers end it as a return value, and the assertions below stop
// the build where a header disagrees with the sizes that the bindings assume.

#include "guard.h"

static_assert(sizeof(Number) == sizeof(double), "Ipopt was built with another Number than double");
static_assert(sizeof(Index) == sizeof(int), "Ipopt was built with another Index than int");
static_assert(sizeof(Bool) == sizeof(int) || sizeof(Bool) == 1, "Bool is neither int nor bool");
static_assert(sizeof(enum ApplicationReturnStatus) == sizeof(int), "statuses are not int-sized");

namespace {

// The header takes pointers to what it only reads as pointers to what it may write.
template <typename T>
T* unconst(const T* pointer)
{
    return const_cast<T*>(pointer);
}

// What `call` returns, a Bool, as 1 or 0; 0 where it throws.
template <typename Call>
int accepted(Call call)
{
    try {
        return call() ? 1 : 0;
    } catch (...) {
        return 0;
    }
}

} // namespace

extern "C" IpoptProblem ipopt_sys_create(
    int n, const double* x_L, const double* x_U, int m, const double* g_L, const double* g_U,
    int nele_jac, int nele_hess, Eval_F_CB eval_f, Eval_G_CB eval_g,
    Eval_Grad_F_CB eval_grad_f, Eval_Jac_G_CB eval_jac_g, Eval_H_CB eval_h)
{
    const int c_style_indices = 0;
    try {
        return CreateIpoptProblem(n, unconst(x_L), unconst(x_U), m, unconst(g_L), unconst(g_U),
                                  nele_jac, nele_hess, c_style_indices,
                                  eval_f, eval_g, eval_grad_f, eval_jac_g, eval_h);
    } catch (...) {
        return nullptr;
    }
}

extern "C" int ipopt_sys_set_text(IpoptProblem problem, const char* name, const char* value)
{
    return accepted([=] { return AddIpoptStrOption(problem, unconst(name), unconst(value)); });
}

extern "C" int ipopt_sys_set_number(IpoptProblem problem, const char* name, double value)
{
    return accepted([=] { return AddIpoptNumOption(problem, unconst(name), value); });
}

extern "C" int ipopt_sys_set_integer(IpoptProblem problem, const char* name, int value)
{
    return accepted([=] { return AddIpoptIntOption(problem, unconst(name), value); });
}

extern "C" int ipopt_sys_watch(IpoptProblem problem, Intermediate_CB callback)
{
    return accepted([=] { return SetIntermediateCallback(problem, callback); });
}

extern "C" int ipopt_sys_solve(
    IpoptProblem problem, double* x, double* g, double* obj_val,
    double* mult_g, double* mult_x_L, double* mult_x_U, UserDataPtr user_data)
{
    try {
        return static_cast<int>(
            IpoptSolve(problem, x, g, obj_val, mult_g, mult_x_L, mult_x_U, user_data));
    } catch (...) {
        return static_cast<int>(NonIpopt_Exception_Thrown);
    }
}

extern "C" void ipopt_sys_free(IpoptProblem problem)
{
    try {
        FreeIpoptProblem(problem);
    } catch (...) {
    }
}
