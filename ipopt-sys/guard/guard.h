/* Ipopt's two calls that run C++ of unbounded depth, behind a catch-all. */
#ifndef IPOPT_SYS_GUARD_H
#define IPOPT_SYS_GUARD_H

#include "IpStdCInterface.h"

#ifdef __cplusplus
extern "C" {
#endif

/* CreateIpoptProblem; a null pointer where it throws. */
IpoptProblem ipopt_sys_create(
    int n, double* x_L, double* x_U, int m, double* g_L, double* g_U,
    int nele_jac, int nele_hess, Eval_F_CB eval_f, Eval_G_CB eval_g,
    Eval_Grad_F_CB eval_grad_f, Eval_Jac_G_CB eval_jac_g, Eval_H_CB eval_h);

/* IpoptSolve as a plain integer; NonIpopt_Exception_Thrown (-101) where it throws. */
int ipopt_sys_solve(
    IpoptProblem problem, double* x, double* g, double* obj_val,
    double* mult_g, double* mult_x_L, double* mult_x_U, UserDataPtr user_data);

#ifdef __cplusplus
}
#endif
#endif
