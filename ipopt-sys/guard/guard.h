/* Every call into Ipopt that this crate makes, each behind a catch-all. */
#ifndef IPOPT_SYS_GUARD_H
#define IPOPT_SYS_GUARD_H

#include "IpStdCInterface.h"

#ifdef __cplusplus
extern "C" {
#endif

/* CreateIpoptProblem with indices from 0; a null pointer where it throws. */
IpoptProblem ipopt_sys_create(
    int n, const double* x_L, const double* x_U, int m, const double* g_L, const double* g_U,
    int nele_jac, int nele_hess, Eval_F_CB eval_f, Eval_G_CB eval_g,
    Eval_Grad_F_CB eval_grad_f, Eval_Jac_G_CB eval_jac_g, Eval_H_CB eval_h);

/* AddIpoptStrOption, AddIpoptNumOption, AddIpoptIntOption and SetIntermediateCallback: 1 where
   accepted, 0 where refused and where they throw. */
int ipopt_sys_set_text(IpoptProblem problem, const char* name, const char* value);
int ipopt_sys_set_number(IpoptProblem problem, const char* name, double value);
int ipopt_sys_set_integer(IpoptProblem problem, const char* name, int value);
int ipopt_sys_watch(IpoptProblem problem, Intermediate_CB callback);

/* IpoptSolve as a plain integer; NonIpopt_Exception_Thrown (-101) where it throws. */
int ipopt_sys_solve(
    IpoptProblem problem, double* x, double* g, double* obj_val,
    double* mult_g, double* mult_x_L, double* mult_x_U, UserDataPtr user_data);

/* FreeIpoptProblem. Where it throws, what it has not freed yet is lost: the problem is half
   taken apart and cannot be used for anything. */
void ipopt_sys_free(IpoptProblem problem);

#ifdef __cplusplus
}
#endif
#endif
